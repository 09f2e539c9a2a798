#pragma once

#include <cmath>
#include <vector>

namespace lowlux::test {

/// Returns first, first + step, ... up to and including last where it is met.
inline std::vector<double> steps(double first, double last, double step) {
  std::vector<double> values;
  const int count = static_cast<int>(std::floor((last - first) / step + 1e-9));
  for (int i = 0; i <= count; ++i) values.push_back(first + i * step);
  return values;
}

/// Returns first, first * ratio, ... up to last.
inline std::vector<double> ratios(double first, double last, double ratio) {
  std::vector<double> values;
  const int count = static_cast<int>(std::floor(std::log(last / first) / std::log(ratio) + 1e-9));
  for (int i = 0; i <= count; ++i) values.push_back(first * std::pow(ratio, i));
  return values;
}

}  // namespace lowlux::test
