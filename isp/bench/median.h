#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace lowlux::isp {

/// The middle value, the upper one of two; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// How far times are apart: half the distance of their quartiles, linear between values, over the median. Not a number
/// of fewer than two.
inline double spread_of(std::vector<double> times) {
  if (times.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  std::sort(times.begin(), times.end());
  const auto quantile = [&times](double share) {
    const double place = share * static_cast<double>(times.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, times.size() - 1);
    return std::lerp(times[below], times[above], place - static_cast<double>(below));
  };
  return (quantile(0.75) - quantile(0.25)) / (2 * quantile(0.5));
}

}  // namespace lowlux::isp
