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

/// A design matrix: one row for each observation, one column for each parameter.
using Design = std::vector<std::vector<double>>;

/// Returns the estimators of weighted least squares: each parameter is a weighted sum of the observations. Row i holds
/// the weights of parameter i: (A^T W A)^-1 A^T W. nullopt where the observations do not determine all parameters.
/// @param weights one for each observation, above 0
std::optional<Design> linear_estimators(const Design& design, std::span<const double> weights);

/// Fit of groups of darks, with each site's estimators: the parameters are weighted sums of the groups' means.
struct DarkFit {
  std::span<const DarkGroup> groups;
  Estimate gain;
  std::vector<double> temperature_c;           // distinct, rising; one entry if none is stated
  std::vector<int> temperature_of;             // index for each group
  std::vector<PerSite<SiteSpread>> spread;     // for each group
  std::vector<PerSite<double>> noise_dn2;      // temporal, of one frame
  std::vector<PerSite<double>> correction_dn;  // to be added to the means
  PixelMask mask;
  Design design;
  std::array<Design, 4> estimators;  // estimators of each site: pedestal, then one slope for each temperature
};

/// Begins a fit: separates the temperatures, and masks pixels more than 5 standard deviations from their site's median
/// in any group.
DarkFit begin_fit(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e);

/// Computes noise, estimators and corrections. Errors: see fit_dark_series.
Result<void> finish_fit(DarkFit& fit);

/// Returns the weighted sum over the groups of a site's means, corrections included.
/// @param weights one for each group
Estimate estimate(const DarkFit& s, const std::vector<double>& weights, int site);

/// Returns every site's mean in every group, with its deviation from the fit.
/// @param parameters  pedestal, then one slope for each temperature
std::vector<DarkPoint> points_of(const DarkFit& fit, std::span<const PerSite<Estimate>> parameters);

/// Returns the temporal noise of a pixel about its row, without dark charge and quantisation [e-]; nullopt if the
/// remaining variance is not positive.
/// @param group  with little dark charge
/// @param dark_charge_dn  dark charge of each site, in that group
std::optional<Estimate> read_noise_of(const DarkFit& fit, std::size_t group, const PerSite<double>& dark_charge_dn);

/// Returns a map of a parameter for every pixel: the groups' means weighted by the estimators `parameter` of their
/// sites, divided by `unit`.
Plane<float> map_of(const DarkFit& fit, std::size_t parameter, double unit);

/// Distribution of a Poisson variable plus a normal one [e-].
struct PoissonGauss {
  double poisson_mean_e = 0;      // 0..1e6
  double normal_variance_e2 = 0;  // above 0
};

/// Returns the mean of the values between low and high, less the mean of all [e-]: the bias of a mean that excludes the
/// others. It is an exact sum over the Poisson counts within ten standard deviations. 0 if no values lie between.
double truncation_bias_e(const PoissonGauss& law, double low_e, double high_e);

}  // namespace lowlux::calib
