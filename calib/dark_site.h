#pragma once

#include "calib/dark_image.h"
#include "calib/dark_stack.h"
#include "isp/base/cfa.h"

namespace lowlux::calib {

/// Figures of one site of a group of darks.
struct DarkSite {
  SiteSpread spread;     // of the means
  double noise_dn2 = 0;  // temporal, of one frame
};

/// Pixels beyond five deviations of the means are left out of the noise. Of a single frame it is half the variance of
/// the differences of neighbours: the pattern is in it, so that it is too large, but a glow or a scene is not.
PerSite<DarkSite> sites_of(const DarkGroup& group);

/// How much variance a hot pixel has for each DN it is above its site: the system gain [DN/e-], as the median over
/// pixels more than 8 standard deviations of one frame above their site, so that those that are full do not count. The
/// median of a chi-square law of n degrees is taken for n (1 - 2 / (9 n))^3 (Wilson and Hilferty, 1931).
/// @return 0 with a single frame or fewer than 16 such pixels
double hot_pixel_gain_dn(const DarkGroup& group, const PerSite<DarkSite>& sites);

}  // namespace lowlux::calib
