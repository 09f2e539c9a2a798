#pragma once

#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Holds the mean charges up to which noise clips a stated fraction of the pixels, or less, at each limit of a sensor.
struct SaturationLimits {
  double full_well_e = 0;  // the pixels are full
  double converter_e = 0;  // the code is the largest

  double min_e() const { return full_well_e < converter_e ? full_well_e : converter_e; }
};

/// Returns z such that a standard normal variable exceeds it with this probability, in 0..1.
double normal_quantile_above(double probability);

/// Returns the charge between black and the largest code.
double code_range_e(const SensorModel& sensor);

/// Returns the mean charge m that is z standard deviations below a limit: m + z sqrt(m + noise^2) = limit. Below 0 if
/// noise alone reaches the limit.
double charge_below(double limit_e, double noise_e, double z);

/// @param z  normal_quantile_above() of the fraction of pixels that noise may clip
SaturationLimits saturation_limits(const SensorModel& sensor, double z);

}  // namespace lowlux::isp
