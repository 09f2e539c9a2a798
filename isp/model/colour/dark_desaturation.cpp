#include "isp/model/colour/dark_desaturation.h"

#include <cmath>

namespace lowlux::isp {

std::optional<double> signal_fraction(const Xyz& signal, const Xyz& dark) {
  const double signal_sum = signal.x + signal.y + signal.z;
  const double all = signal_sum + (dark.x + dark.y + dark.z);
  if (!(signal_sum > 0) || !(all > 0) || !std::isfinite(all)) return std::nullopt;
  return signal_sum / all;
}

Xy desaturated(const Xy& signal, const Xy& dark, double alpha) {
  return {alpha * signal.x + (1 - alpha) * dark.x, alpha * signal.y + (1 - alpha) * dark.y};
}

std::optional<Xy> resaturated(const Xy& measured, const Xy& dark, double alpha) {
  // The result is a step from the dark: near alpha = 0 the textbook form would subtract two products.
  const Xy out{dark.x + (measured.x - dark.x) / alpha, dark.y + (measured.y - dark.y) / alpha};
  if (!(alpha > 0) || !std::isfinite(out.x) || !std::isfinite(out.y)) return std::nullopt;
  return out;
}

std::optional<Xy> resaturated(const Xyz& measured, const Xyz& dark) {
  return xy_of(Xyz{measured.x - dark.x, measured.y - dark.y, measured.z - dark.z});
}

}  // namespace lowlux::isp
