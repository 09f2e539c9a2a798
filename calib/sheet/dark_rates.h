#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark current at one temperature of the sensor.
struct RateAtTemperature {
  double temperature_c = 0;
  Estimate e_per_s;  // with a standard error above 0
};

/// Arrhenius law of the dark current, D(T) = F + A exp(-E / (k T)) with T in kelvin (Widenhorn and others 2002, without
/// the slow power of T).
struct DarkLaw {
  Estimate activation_ev;  // E
  Estimate floor_e_per_s;  // F, which cooling does not reduce; may lie below 0 by its error
};

/// Fits the law by weighted least squares to the rates at three or more temperatures that differ by more than a degree.
/// Standard errors are those that the rates' errors give, to first order, and larger where the law misfits the rates by
/// clearly more than these. Returns nullopt if there are fewer temperatures, if the rates do not determine an energy of
/// 0.1 to 2 eV with an error below a half of it, or if a current that doubles with a fixed number of degrees fits them
/// as well: a floor would only absorb the difference of the two laws.
std::optional<DarkLaw> fit_dark_law(std::span<const RateAtTemperature> rates);

/// Dark current of all pixels together at one temperature, hot ones included (EMVA 1288 R4, section 7).
struct DarkRate {
  std::optional<double> temperature_c;  // absent if the frames do not state it
  Estimate by_mean_e_per_s;             // slope of the mean over the exposure time, over K
  Estimate by_variance_e_per_s;         // slope of the temporal variance, over K^2; expected to be equal
  int exposures = 0;
};

/// Holds the dark current at several temperatures, and its laws.
struct DarkRates {
  std::vector<DarkRate> rates;  // by rising temperature
  /// By the means of two or more temperatures; absent if one is not above 0. Its standard error is larger where
  /// currents deviate from the doubling by clearly more than their errors explain.
  std::optional<Estimate> doubling_c;
  std::optional<DarkLaw> law;  // by the means of three or more temperatures, if they determine it
};

/// Returns whether more than 1 % of the pixels have means above `full_dn`: the mean and the variance of such darks are
/// too low.
bool is_saturated(const DarkGroup& group, double full_dn);

/// Fits straight lines to groups of darks of one gain setting, those of each temperature (same_temperature_c) alone;
/// saturated groups and temperatures with a single exposure time are left out. Standard errors of means include that
/// the pixels are a sample of the sensor's; those of variances are by the scatter of pixels. Errors: no temperature has
/// two exposure times; a group has fewer than two frames; cameras differ.
/// @param full_dn  code above which a pixel may be saturated
Result<DarkRates> dark_rates(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e,
                             double full_dn = std::numeric_limits<double>::infinity());

}  // namespace lowlux::calib
