#include "calib/noise/sensor_class.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr double short_focal_length_mm = 9;  // lenses of large sensors are longer, but for fisheyes
constexpr double largest_small_range_dn = 1023;

/// Returns the factor of two independent uncertainties.
double joined_factor(double one, double other) { return std::exp(std::hypot(std::log(one), std::log(other))); }

SensorClass class_of(const RawDn& raw) {
  const auto& focal_length_mm = raw.info.focal_length_mm;
  const bool is_small = (focal_length_mm && *focal_length_mm < short_focal_length_mm) ||
                        *std::max_element(raw.white_dn.begin(), raw.white_dn.end()) <= largest_small_range_dn;
  return is_small ? SensorClass::small : SensorClass::large;
}

}  // namespace

double class_read_noise_e(double electrons_at_white) {
  return std::hypot(read_floor_e, read_fraction * electrons_at_white);
}

ClassNoise class_noise(const RawDn& raw, double range_dn) {
  assert(range_dn > 0);
  ClassNoise out{.kind = class_of(raw), .figures = {}};
  const bool is_small = out.kind == SensorClass::small;
  double electrons = is_small ? small_sensor_e : large_sensor_e;
  double factor = is_small ? small_sensor_factor : large_sensor_factor;
  if (raw.info.iso) {
    electrons *= std::min(100 / *raw.info.iso, 2.0);
  } else {
    electrons /= std::sqrt(gain_range);
    factor = joined_factor(factor, std::exp(std::log(gain_range) / std::sqrt(12.0)));  // of a uniform distribution
  }
  out.figures = {.gain_dn_per_e = range_dn / electrons,
                 .read_noise_e = class_read_noise_e(electrons),
                 .gain_factor = factor,
                 .read_noise_factor = read_noise_factor};
  return out;
}

std::string text_of(const ClassNoise& noise, const FrameInfo& info) {
  return std::string(noise.kind == SensorClass::small ? "small sensor" : "large sensor") +
         (info.iso ? fmt::format(" at ISO {:g}", *info.iso) : std::string(", ISO not stated"));
}

}  // namespace lowlux::calib
