#pragma once

#include <array>
#include <span>
#include <vector>

#include "calib/dark_image.h"
#include "calib/dark_stack.h"
#include "calib/linear_estimators.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Groups of darks, and each site's estimators: the parameters are weighted sums of the groups' means.
struct DarkFit {
  std::span<const DarkGroup> groups;
  Estimate gain;
  std::vector<double> temperature_c;           // distinct, rising; one entry if none is stated
  std::vector<int> temperature_of;             // of each group
  std::vector<PerSite<SiteSpread>> spread;     // of each group
  std::vector<PerSite<double>> noise_dn2;      // temporal, of one frame
  std::vector<PerSite<double>> correction_dn;  // to be added to the means
  PixelMask mask;
  Design design;
  std::array<Design, 4> estimators;  // of each site: pedestal, then one slope for each temperature
};

/// Temperatures told apart, and the mask of pixels more than 5 standard deviations from their site's median in any
/// group.
DarkFit begin_fit(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e);

/// Noise, estimators and corrections. Errors: see fit_dark_series.
Result<void> finish_fit(DarkFit& fit);

/// Weighted sum over the groups of a site's means; corrections included.
/// @param weights one for each group
Estimate estimate(const DarkFit& s, const std::vector<double>& weights, int site);

}  // namespace lowlux::calib
