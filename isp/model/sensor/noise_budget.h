#pragma once

#include <array>

#include "isp/base/result.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Returns an error unless the sensor is possible: figures finite and not negative, gain and full well positive, read,
/// row and column noise of at most largest_noise_e, 1 to 16 bits, 0 <= black < white <= 2^bits - 1, an integer white
/// level, a dark current that doubles every 1 to 1000 degrees, a full well the sampler can draw.
Result<void> check_sensor(const SensorModel& sensor);

/// Limits the standard deviations that check_sensor() accepts [e-]: more than any full well.
inline constexpr double largest_noise_e = 1e6;

/// Limits the full well that check_sensor() accepts [e-]: seven standard deviations below the sampler's limit, so that
/// a mean beyond the limit fills the pixel in any case.
inline constexpr double largest_full_well_e = 9.9e5;

/// Limits the crosstalk that check_sensor() accepts: a pixel keeps as much of its light as each neighbour collects.
inline constexpr double largest_crosstalk = 0.2;

/// Describes the exposure of a frame.
struct Exposure {
  double time_s = 1;
  double temperature_c = 20;  // temperature of the sensor
};

/// Returns an error unless the time is finite and not negative and the temperature within -100..150 C.
Result<void> check_exposure(const Exposure& exposure);

inline constexpr double boltzmann_ev_per_k = 1.380649e-23 / 1.602176634e-19;  // k / e, exact in the SI since 2019
inline constexpr double zero_celsius_k = 273.15;

/// Returns the factor of dark current above the floor against the sensor's reference temperature: with an activation
/// energy, the Arrhenius law exp(-(E_a / k) (1 / T - 1 / T_ref)), T in kelvin (Widenhorn and others 2002, without
/// the slow power of T); else 2^((T - T_ref) / dT).
double dark_current_factor(const SensorModel& sensor, double temperature_c);

/// Returns the mean dark charge of R, G, B pixels that are not hot [e-]: time (floor + (D - floor) factor), with D the
/// current at the reference temperature.
std::array<double, 3> dark_mean_e(const SensorModel& sensor, const Exposure& exposure);

/// Returns the variance that telegraph noise adds over all pixels [e-^2]: f a^2 / 2 for a fraction f of pixels at +A/2
/// or -A/2, with A exponentially distributed of mean a. The fourth moment is 3 f a^4 / 2.
double telegraph_variance_e2(const SensorModel& sensor);

/// Returns the charge at which a pixel reads the largest code: its full well or the converter's range, whichever is
/// less [e-].
double saturation_charge_e(const SensorModel& sensor);

/// Returns which of R, G and B are saturated: where one is, the colour of the pixels is not that of the light, and
/// means of noisy pixels hide it. A pixel counts as full from five standard deviations of the noise after collection
/// below the code at which it saturates.
/// @param largest_dn the largest code of each channel; one that is not a number is flagged too
std::array<bool, 3> saturated_channels(const SensorModel& sensor, const std::array<double, 3>& largest_dn);

/// Holds the mean charge of one pixel.
struct MeanCharge {
  double signal_e = 0;
  double dark_e = 0;
};

/// Returns the variance of one pixel of an array without fixed pattern, in DN^2, far from full well and the ends of the
/// range:
///     Var = K^2 (mu + d + sigma_r^2) + 1/12
/// @note Thesis Eq. 4.12 adds the shot term in V to terms in V^2; this is the consistent form.
double variance_dn2(const SensorModel& sensor, const MeanCharge& charge);

/// Returns the signal-to-noise ratio as a ratio of powers, (K mu)^2 / Var (thesis Eq. 4.13).
double snr(const SensorModel& sensor, const MeanCharge& charge);

/// Holds mean and variance of a random variable.
struct Moments {
  double mean = 0;
  double variance = 0;
};

/// Returns mean and variance of a normal variable clamped to two bounds (either may be infinite): clamp(X, low, high).
/// Exact; a variance of 0 is allowed.
Moments clamped_normal(const Moments& normal, double low, double high);

/// Bounds the change of mean and variance when a normal variable of standard deviation `std_dn` is quantised, at the
/// worst position between two codes:
///     |mean - m -+ offset| <= sum over n of exp(-2 pi^2 n^2 s^2) / (pi n) <= 1/2,  |variance - s^2 - 1/12| likewise.
/// (Widrow & Kollar, Quantization Noise, 2008, section 4: the characteristic function of the quantiser's input.)
struct QuantisationBounds {
  double mean_dn;
  double variance_dn2;
};
QuantisationBounds quantisation_bounds(double std_dn);

}  // namespace lowlux::isp
