#include "isp/metrics/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace lowlux::isp {
Estimate mean_of(std::span<const double> samples) {
  assert(samples.size() > 1);
  const auto n = static_cast<double>(samples.size());
  double mean = 0, squares = 0;
  for (const double s : samples) mean += s / n;
  for (const double s : samples) squares += (s - mean) * (s - mean);
  return {mean, std::sqrt(squares / (n - 1) / n)};
}

Estimate power_law_exponent(std::span<const double> x, std::span<const Estimate> log_y) {
  assert(x.size() == log_y.size() && x.size() > 1);
  double weights = 0, mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = 1 / (log_y[i].standard_error * log_y[i].standard_error);
    weights += w;
    mean_x += w * std::log(x[i]);
    mean_y += w * log_y[i].value;
  }
  mean_x /= weights;
  mean_y /= weights;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = 1 / (log_y[i].standard_error * log_y[i].standard_error);
    const double dx = std::log(x[i]) - mean_x;
    xx += w * dx * dx;
    xy += w * dx * (log_y[i].value - mean_y);
  }
  return {xy / xx, 1 / std::sqrt(xx)};
}

Estimate log_size_of(const XyCovariance& c, std::size_t n) {
  const double trace = c.xx + c.yy;
  const double trace_of_square = c.xx * c.xx + 2 * c.xy * c.xy + c.yy * c.yy;
  const double relative = std::sqrt(2 * trace_of_square / static_cast<double>(n - 1)) / trace;
  return {0.5 * std::log(trace), 0.5 * relative};
}

double orientation_error(const XyCovariance& sampled, const XyCovariance& expected, double inclination_deg,
                         std::size_t n) {
  const double twice = 2 * inclination_deg * std::numbers::pi / 180;
  const double between_axes = 0.5 * (sampled.yy - sampled.xx) * std::sin(twice) + sampled.xy * std::cos(twice);
  return std::fabs(between_axes) /
         std::sqrt((expected.xx * expected.yy - expected.xy * expected.xy) / static_cast<double>(n - 1));
}

double worst_covariance_error(const XyCovariance& sampled, const XyCovariance& expected, std::size_t n) {
  const double root = std::sqrt(static_cast<double>(n - 1));
  const double xx = std::fabs(sampled.xx - expected.xx) / (std::numbers::sqrt2 * expected.xx);
  const double yy = std::fabs(sampled.yy - expected.yy) / (std::numbers::sqrt2 * expected.yy);
  const double xy =
      std::fabs(sampled.xy - expected.xy) / std::sqrt(expected.xx * expected.yy + expected.xy * expected.xy);
  return root * std::max({xx, yy, xy});
}

double mean_error(const Xy& sampled, const Xy& expected, const XyCovariance& c, std::size_t n) {
  const double determinant = c.xx * c.yy - c.xy * c.xy;
  if (!(determinant > 0)) return std::numeric_limits<double>::infinity();
  const double dx = sampled.x - expected.x, dy = sampled.y - expected.y;
  return std::sqrt(static_cast<double>(n) * (c.yy * dx * dx - 2 * c.xy * dx * dy + c.xx * dy * dy) / determinant);
}

}  // namespace lowlux::isp
