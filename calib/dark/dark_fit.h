#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calib/dark/dark_figures.h"
#include "calib/dark/dark_image.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// One row for each observation, one column for each parameter.
using Design = std::vector<std::vector<double>>;

/// Weighted least squares as what it is: each parameter a weighted sum of the observations. Row i holds the weights of
/// parameter i: (A^T W A)^-1 A^T W. nullopt where the observations do not determine all parameters.
/// @param weights one for each observation, above 0
std::optional<Design> linear_estimators(const Design& design, std::span<const double> weights);

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

/// Every site's mean in every group, and how far it lies from the fit.
/// @param parameters  pedestal, then one slope for each temperature
std::vector<DarkPoint> points_of(const DarkFit& fit, std::span<const PerSite<Estimate>> parameters);

/// Temporal noise of a pixel about its row, without dark charge and quantisation [e-]; none if nothing is left of it.
/// @param group  with little dark charge
/// @param dark_charge_dn  of each site, in that group
std::optional<Estimate> read_noise_of(const DarkFit& fit, std::size_t group, const PerSite<double>& dark_charge_dn);

/// A parameter pixel by pixel: the groups' means weighted by the estimators `parameter` of their sites, divided by
/// `unit`.
Plane<float> map_of(const DarkFit& fit, std::size_t parameter, double unit);

/// A Poisson variable plus a normal one [e-].
struct PoissonGauss {
  double poisson_mean_e = 0;      // 0..1e6
  double normal_variance_e2 = 0;  // above 0
};

/// Mean of the values between low and high, less the mean of all [e-]: what leaving out the others does to a mean.
/// Exact sum over the Poisson counts within ten standard deviations. 0 if nothing lies between.
double truncation_bias_e(const PoissonGauss& law, double low_e, double high_e);

}  // namespace lowlux::calib
