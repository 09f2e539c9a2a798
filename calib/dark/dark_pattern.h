#pragma once

#include "calib/dark/dark_image.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Temporal noise of one site's pixels.
struct DarkNoise {
  double picture_dn2 = 0;   // variance of the image without light
  double estimate_dn2 = 0;  // variance of the estimated dark frame, rows included
  double rows_dn2 = 0;      // the part of `estimate_dn2` that whole rows have in common; 0 if not known
  bool rows_known = false;
};

/// Noise added by a dark frame, and the fraction of its pattern that was kept.
struct KeptPattern {
  double mean_dn = 0;         // mean of the pixels that are not outliers
  double added_dn2 = 0;       // mean over the pixels
  double pixel_fraction = 1;  // fraction of a pixel's own deviation, outliers excluded
};

/// Shrinks the deviations of one site's pixels from its mean, so that subtracting them adds no more noise than the
/// fraction `share` allows. Nothing is changed where the unshrunk deviation meets the limit. Else columns, rows and
/// pixels are weighted by
///     w = P / (P + N)        (Wiener; P: variance of the pattern, N: of the estimate's noise)
/// the pixels' w being limited by what `share` leaves. Pixels five standard deviations off are not shrunk: such a
/// deviation is not noise. So the mean square error falls with every dark, from the first.
/// @param share   share of picture_dn2
/// @param unknown pixels that are excluded
KeptPattern limit_noise(Plane<float>& dn, int site, const DarkNoise& noise, double share, const PixelMask& unknown);

}  // namespace lowlux::calib
