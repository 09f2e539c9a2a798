#pragma once

#include "calib/dark_image.h"
#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Temporal noise of one site's pixels.
struct DarkNoise {
  double picture_dn2 = 0;   // of the picture without light
  double estimate_dn2 = 0;  // of the dark frame, rows included
  double rows_dn2 = 0;      // of it what whole rows have in common; 0 if not known
  bool rows_known = false;
};

/// What a dark frame adds, and what was kept of its pattern.
struct KeptPattern {
  double mean_dn = 0;      // of the pixels that do not stand out
  double added_dn2 = 0;    // mean over the pixels
  double pixel_share = 1;  // of a pixel's own deviation, those that stand out left aside
};

/// Shrinks what one site's pixels deviate from its mean, so that subtracting them adds no more noise than the share
/// allows. Nothing is changed where the whole deviation does not. Else columns, rows and pixels are weighted by
///     w = P / (P + N)        (Wiener; P: variance of the pattern, N: of the estimate's noise)
/// the pixels' w being at most what the share leaves. Pixels five standard deviations off are kept whole: such a
/// deviation is no noise. So the mean square error falls with every dark, from the first.
/// @param share   of picture_dn2
/// @param unknown pixels that take no part
KeptPattern limit_noise(Plane<float>& dn, int site, const DarkNoise& noise, double share, const PixelMask& unknown);

}  // namespace lowlux::calib
