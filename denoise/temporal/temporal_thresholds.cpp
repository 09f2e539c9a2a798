#include "denoise/temporal/temporal_thresholds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lowlux::denoise {
namespace {

/// Returns the point in 0..most where a falling function crosses `wanted`.
template <class Falling>
double solve(double least, double most, double wanted, const Falling& falling) {
  for (int i = 0; i < 80; ++i) {
    const double middle = (least + most) / 2;
    (falling(middle) > wanted ? least : most) = middle;
  }
  return (least + most) / 2;
}

double normal_tail(double z) { return std::erfc(z / std::numbers::sqrt2) / 2; }

/// Returns the tail probability of chi-square with 3 degrees of freedom above x.
double chi3_tail(double x) {
  return std::erfc(std::sqrt(x / 2)) + std::sqrt(2 * x / std::numbers::pi) * std::exp(-x / 2);
}

/// Returns the quantile of chi-square with 3 degrees of freedom of Wilson and Hilferty.
double approximate_chi3(double z) {
  const double by_shape = 1 / 1.5;
  return 3 * std::pow(1 - by_shape / 9 + z / 3 * std::sqrt(by_shape), 3);
}

/// Returns the threshold for a rate of false alarms.
/// @param rate  at which either of two independent statistics is above its threshold
MotionThreshold threshold_of(double rate) {
  const double of_one = 1 - std::sqrt(1 - rate);
  const double z = solve(-10, 10, of_one, normal_tail);
  const double exact = solve(0, 200, of_one, chi3_tail);
  return {.z = z, .few = exact / approximate_chi3(z)};
}

}  // namespace

MotionThresholds motion_thresholds(double false_alarm) {
  const double beside = std::cbrt(false_alarm);
  const auto still = [beside](double alone) { return 1 - alone - (beside - alone) * (1 - std::pow(1 - alone, 8)); };
  return {.alone = threshold_of(solve(0, false_alarm, 1 - false_alarm, still)), .beside = threshold_of(beside)};
}

double chi3_threshold(const MotionThreshold& at) { return at.few * approximate_chi3(at.z); }

rows::SiteNoise site_noise(const RawNoise& noise, BayerPhase phase) {
  const PerSite<int> site = sites_of(phase);
  const auto& dark = noise.dark_mean_e;
  const std::array dark_e{dark[site[0]], (dark[site[1]] + dark[site[2]]) / 2, dark[site[3]]};
  rows::SiteNoise out{};
  for (int c = 0; c < 3; ++c) {
    out.dark_e[c] = static_cast<float>(dark_e[c]);
    out.variance_e2[c] = static_cast<float>(noise.variance_e2[c]);
    out.min_e2[c] = static_cast<float>(0.5 * noise.variance_e2[c] + 0.3 * dark_e[c] + 0.02);
    // Subtract as the kernels do: a saturated value stays saturated in every bit.
    out.saturation_e[c] = static_cast<float>(std::min(noise.saturation_e[c], largest_value_e)) - out.dark_e[c];
  }
  return out;
}

double variance_of(const rows::SiteNoise& noise, std::size_t colour, double signal_e) {
  const double told =
      signal_e + static_cast<double>(noise.dark_e[colour]) + static_cast<double>(noise.variance_e2[colour]);
  return std::max(told, static_cast<double>(noise.min_e2[colour]));
}

}  // namespace lowlux::denoise
