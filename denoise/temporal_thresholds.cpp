#include "denoise/temporal_thresholds.h"

#include <cmath>
#include <numbers>

namespace lowlux::denoise {
namespace {

/// Where a falling function of 0..most passes `wanted`.
template <class Falling>
double solve(double least, double most, double wanted, const Falling& falling) {
  for (int i = 0; i < 80; ++i) {
    const double middle = (least + most) / 2;
    (falling(middle) > wanted ? least : most) = middle;
  }
  return (least + most) / 2;
}

double normal_tail(double z) { return std::erfc(z / std::numbers::sqrt2) / 2; }

/// Of chi-square with 3 degrees of freedom.
double chi3_tail(double x) {
  return std::erfc(std::sqrt(x / 2)) + std::sqrt(2 * x / std::numbers::pi) * std::exp(-x / 2);
}

/// @param rate  at which either of two independent statistics is above its threshold
MotionThreshold threshold_of(double rate) {
  const double of_one = 1 - std::sqrt(1 - rate), shape = 1.5;
  const double z = solve(-10, 10, of_one, normal_tail);
  const double exact = solve(0, 200, of_one, chi3_tail);
  return {.z = z, .few = exact / (3 * std::pow(1 - 1 / (9 * shape) + z / (3 * std::sqrt(shape)), 3))};
}

}  // namespace

MotionThresholds motion_thresholds(double false_alarm) {
  const double beside = std::cbrt(false_alarm);
  const auto still = [beside](double alone) { return 1 - alone - (beside - alone) * (1 - std::pow(1 - alone, 8)); };
  return {.alone = threshold_of(solve(0, false_alarm, 1 - false_alarm, still)), .beside = threshold_of(beside)};
}

}  // namespace lowlux::denoise
