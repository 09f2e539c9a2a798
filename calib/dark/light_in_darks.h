#pragma once

#include <optional>
#include <span>
#include <string>

#include "calib/dark/dark_image.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Statistics of one site of a group of darks.
struct DarkSite {
  SiteSpread spread;     // spread of the means
  double noise_dn2 = 0;  // temporal, of one frame
};

/// Returns the statistics of each site. Pixels beyond five deviations of the means are excluded from the noise. For a
/// single frame it is half the variance of the differences of neighbours: this includes the pattern, so that it is too
/// large, but not a glow or a scene.
PerSite<DarkSite> sites_of(const DarkGroup& group);

/// Returns the variance of a hot pixel for each DN it is above its site: the system gain [DN/e-], as the median over
/// pixels more than 8 standard deviations of one frame above their site, so that saturated pixels have no effect. The
/// median of a chi-square distribution of n degrees is approximated by n (1 - 2 / (9 n))^3 (Wilson and Hilferty, 1931).
/// @return 0 with a single frame or fewer than 16 such pixels
double hot_pixel_gain_dn(const DarkGroup& group, const PerSite<DarkSite>& sites);

/// Checks whether a group is brighter on one side than on the other: by more than five standard errors, one frame's
/// noise, and a quarter of the charge above the pedestal where that is known. Error (malformed): it is.
Result<void> check_even_dark(const DarkGroup& group, const PerSite<DarkSite>& sites,
                             const std::optional<PerSite<double>>& pedestal_dn);

/// Checks whether the dark frame has the level of the image's masked pixels. Error: it is off by more than two standard
/// deviations of a pixel and 0.1 % of the range. @return a warning if it is off by more than half of one standard
/// deviation
Result<std::optional<std::string>> check_masked_level(const RawDn& picture, const PerSite<double>& masked_dn,
                                                      const DarkFrame& dark);

/// Returns the variance of a pixel of one site in the darkest tenth of an image's tiles [DN^2]: the median of these
/// tiles, from differences of neighbours.
double darkest_noise_dn2(const RawDn& picture, int site);

/// Checks whether the image is brighter than its dark frame. Error: more than 1 % of its pixels lie more than four
/// standard deviations below (3e-5 of a normal distribution do): subtraction would leave black dots. The deviation is
/// that of the darks or, if that is more, of a pixel in the darkest tenth of the image: a master dark scatters less
/// than one exposure.
Result<void> check_below_picture(const RawDn& picture, const DarkFrame& dark);

}  // namespace lowlux::calib
