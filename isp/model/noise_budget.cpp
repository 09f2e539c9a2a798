#include "isp/model/noise_budget.h"

namespace lowlux::isp {

double variance_dn2(const SensorModel& sensor, const MeanCharge& charge) {
  constexpr double quantisation_dn2 = 1.0 / 12;  // of a uniform error over one code
  const double gain = sensor.system_gain_dn_per_e;
  const double read_e2 = sensor.read_noise_e * sensor.read_noise_e;
  return gain * gain * (charge.signal_e + charge.dark_e + read_e2) + quantisation_dn2;
}

double snr(const SensorModel& sensor, const MeanCharge& charge) {
  const double signal_dn = sensor.system_gain_dn_per_e * charge.signal_e;
  return signal_dn * signal_dn / variance_dn2(sensor, charge);
}

}  // namespace lowlux::isp
