#pragma once

#include <optional>
#include <span>

#include "calib/flat/pair_statistics.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Known properties of the light of the flats.
struct PhotonTransferOptions {
  bool steady_light = false;  // constant lamp: levels differ by exposure time alone, so linearity can be measured
};

/// Charge above which brighter light has no effect.
struct Saturation {
  Estimate charge_e;
  enum class LimitedBy { full_well, converter } limited_by = LimitedBy::full_well;
};

/// Results for one gain setting by the photon transfer method of EMVA 1288 (release 4.0 linear): a part of its data
/// sheet. data_sheet.h computes the rest of it: quantum efficiency, sensitivity threshold, dynamic range, maximum SNR,
/// dark current, and the row, column and pixel parts of PRNU and DSNU. Standard errors are those of the fit, multiplied
/// by sqrt(reduced chi square) where that exceeds 1.
struct PhotonTransfer {
  Estimate system_gain_dn_per_e;              // K: one for all sites
  PerSite<Estimate> gain_of_site_dn_per_e{};  // each site fitted alone: should agree with K
  double reduced_chi_square_of_sites = 0;     // chi square of the four gains about the common one, 3 degrees of freedom
  std::optional<Estimate> read_noise_e;       // temporal dark noise at the darks' exposure; absent if under-dithered
  bool under_dithered = false;                // darks scatter by less than half a code: see quantisation_bounds()
  double row_noise_e = 0;                     // the part of the read noise common to whole rows
  PerSite<double> black_dn{};                 // mean of the darks
  // EMVA: mean charge of the level with the largest variance; absent if not reached. Its error includes that of a value
  // spread evenly up to the level where the variance has fallen.
  std::optional<Estimate> saturation_capacity_e;
  std::optional<Saturation> saturation;  // mean charge of flats without photon noise; absent if there are none
  Estimate prnu;  // relative, at half saturation; contains the nonuniformity of dark current that the darks lack
  std::optional<Estimate> dsnu_e;         // DSNU of the darks; absent if under-dithered
  std::optional<double> linearity_error;  // EMVA LE: mean relative deviation from the line, 5 to 95 % of range
  double reduced_chi_square = 0;          // reduced chi square of variance against mean
  int degrees_of_freedom = 0;
  int levels = 0;                             // levels of light in the linear range of the site that has fewest
  PerSite<double> black_standard_error_dn{};  // from noise and rows; columns and other patterns are part of the black
};

/// Fits variance against mean over the linear range, up to 70 % of the mean where the variance is largest:
///     sigma^2 - 1/12 = K (mu - mu_dark) + K^2 sigma_d^2     [DN^2]
/// with one K and one sigma_d for all sites. Weights are the inverse variances of the points under the fitted line, not
/// of the measured variances, which would bias the line towards points with low measured values.
/// @param darks  at least one pair, all of one exposure time, as short as possible
/// @param flats  pairs at four or more levels; several pairs of a level are several points
/// Errors: no darks, fewer than 1000 pixels of a site, or too few levels left in the linear range; pairs of different
/// cameras, sizes or gains; darks of different times; darks that are clipped at code 0; light that drifts by more than
/// 1 % within a pair; flats that are not brighter than the darks; a fitted gain that is negative or has a standard
/// error above 5 %.
Result<PhotonTransfer> fit_photon_transfer(std::span<const PairStatistics> dark_pairs,
                                           std::span<const PairStatistics> flat_pairs,
                                           const PhotonTransferOptions& options = {});

}  // namespace lowlux::calib
