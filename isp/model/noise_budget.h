#pragma once

#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Mean charge of one pixel in one exposure [e-], each >= 0.
struct MeanCharge {
  double signal_e = 0;  // mu
  double dark_e = 0;    // d
};

/// Variance of a pixel's code [DN^2]: shot noise of signal and dark, read noise, quantisation, in consistent units
///     Var = K^2 (mu + d + sigma_r^2) + 1/12
/// (thesis Eq. 4.12, which writes the shot term in volts beside volts squared). Saturation is left out.
double variance_dn2(const SensorModel& sensor, const MeanCharge& charge);

/// Signal-to-noise ratio as a ratio of powers (thesis Eq. 4.13): (K mu)^2 / Var. Its root is the ratio of amplitudes.
double snr(const SensorModel& sensor, const MeanCharge& charge);

}  // namespace lowlux::isp
