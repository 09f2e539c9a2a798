#pragma once

#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Spatial variances of the pixels of one site, split into what rows, columns and single pixels have of their own (EMVA
/// 1288 R4, section 8.2); unbiased, and so possibly negative.
struct SpatialParts {
  double mean_dn = 0;
  Estimate row_dn2;
  Estimate column_dn2;
  Estimate pixel_dn2;
};

/// Splits the variance of the averaged frame of a stack, for each site alone. With M rows, N columns, and y the average
/// of L frames, the model is y = mu + r_m + c_n + p_mn. The sample variances of row means, of column means and of what
/// is left of pixels are s_row^2 = r^2 + p^2 / N, s_col^2 = c^2 + p^2 / M and p^2, which is the solution of R4's
/// equations for its three measured variances. The temporal noise of the average, sigma^2 / L, is then subtracted from
/// p^2, and that of whole rows from r^2, where R4 assumes that all temporal noise is of single pixels. Standard errors
/// include that the rows and columns of this sensor are a sample; that of pixels is from their fourth moment.
/// Errors: fewer than two frames (check_noise_is_known).
Result<PerSite<SpatialParts>> spatial_parts(const DarkGroup& group);

/// Nonuniformity as root variances: DSNU1288 [e-] or PRNU1288 [relative to the mean signal], 0 where the variance is
/// not positive.
struct Nonuniformity {
  Estimate total;
  Estimate row;
  Estimate column;
  Estimate pixel;
};

/// Returns DSNU1288 of darks: root mean variance of the sites, over K.
Nonuniformity dark_nonuniformity(const PerSite<SpatialParts>& dark, const Estimate& gain_dn_per_e);

/// Returns PRNU1288 (R4 Eq. 36): sqrt(s_50^2 - s_dark^2) / (mu_50 - mu_dark), the mean square of the sites.
/// @param bright  flats near half of saturation, brighter than the darks
/// @param dark    darks of the flats' exposure time
Nonuniformity photo_response_nonuniformity(const PerSite<SpatialParts>& bright, const PerSite<SpatialParts>& dark);

/// Returns the square root of a variance: 0 where it is negative. Its standard error makes the interval of 1.96 errors
/// on both sides hold the roots of the interval of the variance, with 0 where that one reaches below: s / (2 root) far
/// from 0, and the root of s near it.
Estimate root_of(const Estimate& variance);

}  // namespace lowlux::calib
