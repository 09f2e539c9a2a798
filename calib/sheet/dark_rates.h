#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "calib/sheet/dark_law.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark current of all pixels together at one temperature, hot ones included (EMVA 1288 R4, section 7).
struct DarkRate {
  std::optional<double> temperature_c;  // absent if the frames do not state it
  Estimate by_mean_e_per_s;             // slope of the mean over the exposure time, over K
  Estimate by_variance_e_per_s;         // slope of the temporal variance, over K^2; expected to be equal
  int exposures = 0;
};

struct DarkRates {
  std::vector<DarkRate> rates;         // by rising temperature
  std::optional<Estimate> doubling_c;  // by the means of two or more temperatures; absent if one is not above 0
  std::optional<DarkLaw> law;          // by the means of three or more temperatures, if they determine it
};

/// Fits straight lines to groups of darks of one gain setting, those of each temperature (same_temperature_c) alone;
/// temperatures with a single exposure time are left out. Standard errors of means include that the pixels are a sample
/// of the sensor's; those of variances are by the scatter of pixels. Errors: no temperature has two exposure
/// times; a group has fewer than two frames; cameras differ.
Result<DarkRates> dark_rates(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e);

}  // namespace lowlux::calib
