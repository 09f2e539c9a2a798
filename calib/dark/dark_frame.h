#pragma once

#include <optional>
#include <span>

#include "calib/dark/dark_image.h"
#include "calib/dark/dark_stack.h"
#include "isp/base/cfa.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// How darks become the dark frame of a picture.
struct DarkRequest {
  double noise_share = 0.1;                    // most that may be added to the picture's own variance in the dark, 0..1
  std::optional<double> doubling_c;            // degrees over which dark charge doubles, 2..30; absent: fitted
  std::optional<PerSite<double>> masked_dn;    // the picture's masked pixels: pedestal and dark charge in one
  std::optional<PerSite<double>> pedestal_dn;  // the file's tag: level of no charge
};

/// The dark frame of a picture: see weigh_darks for how times and temperatures are scaled, limit_noise for what is kept
/// of a mean of few darks. Pixels are `unknown` whose darks come within 5 % of the range to white, or whose temporal
/// noise in the picture is more than 5 times that of their site.
/// A pedestal follows from masked pixels where there are any: that with which the scaled darks have their level.
/// @param groups  of DarkLibrary
/// Errors: those of weigh_darks; a request out of its range; a picture without exposure time; darks of another camera,
/// size, mosaic or gain; darks that hold light (one side brighter than the other by more than one frame's noise and a
/// quarter of the dark charge); more than a sixteenth of the pixels unknown.
/// The picture's codes are not read: the dark frame is the same for all pictures of one setting and request. Whether it
/// fits each of them, check_masked_level and check_below_picture say.
Result<DarkFrame> make_dark_frame(std::span<const DarkGroup> groups, const RawDn& picture, const DarkRequest& request);

/// The dark frame of another picture of the same setting, made from that of a picture with other masked pixels.
/// Precondition: dark.masked_dn.
DarkFrame at_masked_level(const DarkFrame& dark, const PerSite<double>& masked_dn);

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
