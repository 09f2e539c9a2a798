#pragma once

#include <cmath>

namespace lowlux::isp {

/// Holds an abscissa and the value of a function there.
struct Evaluated {
  double x = 0;
  double f = 0;
};

/// Returns the root of a function between two points of opposite sign: regula falsi in the Illinois form (Dowell &
/// Jarratt 1971), until |f| is within the tolerance or the precision of double is exhausted.
template <class Function>
double bracketed_root(const Function& function, Evaluated kept, Evaluated last, double tolerance) {
  for (int i = 0; i < 100 && std::fabs(last.f) > tolerance; ++i) {
    const double x = (kept.x * last.f - last.x * kept.f) / (last.f - kept.f);
    if (x == last.x) break;
    const Evaluated next{x, function(x)};
    if ((next.f > 0) == (last.f > 0)) {
      kept.f *= 0.5;
    } else {
      kept = last;
    }
    last = next;
  }
  return last.x;
}

}  // namespace lowlux::isp
