#include "isp/model/sensor/saturation_limits.h"

#include <cmath>
#include <numbers>

#include <boost/math/special_functions/erf.hpp>

namespace lowlux::isp {

double normal_quantile_above(double probability) {
  return std::numbers::sqrt2 * boost::math::erfc_inv(2 * probability);
}

double code_range_e(const SensorModel& sensor) {
  return (sensor.white_level_dn - sensor.black_level_dn) / sensor.system_gain_dn_per_e;
}

double charge_below(double limit_e, double noise_e, double z) {
  return limit_e + z * z / 2 - z * std::sqrt(limit_e + noise_e * noise_e + z * z / 4);
}

SaturationLimits saturation_limits(const SensorModel& sensor, double z) {
  return {charge_below(sensor.full_well_e, 0, z), charge_below(code_range_e(sensor), sensor.read_noise_e, z)};
}

}  // namespace lowlux::isp
