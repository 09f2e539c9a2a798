#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/dark/dark_image.h"
#include "calib/dark/dark_stack.h"
#include "calib/dark/master_dark.h"
#include "isp/base/cfa.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Options for making the dark frame of an image.
struct DarkRequest {
  double noise_fraction = 0.1;  // maximum added variance as a fraction of the image's own variance in the dark, 0..1
  std::optional<double> doubling_c;            // degrees over which dark charge doubles, 2..30; absent: fitted
  std::optional<PerSite<double>> masked_dn;    // the image's masked pixels: pedestal plus dark charge
  std::optional<PerSite<double>> pedestal_dn;  // the file's tag: level without charge
  std::optional<DarkNoiseModel> noise;         // noise of the image
  std::vector<double> exposures_per_file;      // one for each group, at least 1; empty: 1
  bool is_bias = false;    // the darks are bias frames: their own exposure time stands for the image's
  bool estimated = false;  // `exposures_per_file` was estimated
};

/// Makes the dark frame of an image: see compute_dark_weights for the scaling of times and temperatures, limit_noise
/// for the weighting of a mean of few darks. The noise of a single file that is a mean of several exposures is that of
/// the noise model divided by their number, plus the variance of rounding to whole codes, 1/12 DN^2; without a noise
/// model it is its own spatial noise, pattern included. Pixels are `unknown` whose darks come within 5 % of the range
/// to white, or whose temporal noise in the image is more than 5 times that of their site. If there are masked pixels,
/// they determine the pedestal: the one with which the scaled darks have the level of the masked pixels.
/// @param groups  groups of DarkLibrary
/// Errors: those of compute_dark_weights; a request out of its range; an image without exposure time; darks of another
/// camera, size, mosaic or gain; darks that hold light (one side brighter than the other by more than one frame's noise
/// and a quarter of the dark charge); more than a sixteenth of the pixels unknown. The image's codes are not read: the
/// dark frame is the same for all images of one setting and request. Use check_masked_level and check_below_picture to
/// check that it fits each of them.
Result<DarkFrame> make_dark_frame(std::span<const DarkGroup> groups, const RawDn& picture, const DarkRequest& request);

/// Returns the dark frame of another image of the same setting, adapted to its masked pixels; or a bias frame at the
/// level of an image's black point, pedestal and dark charge. Precondition: dark.masked_dn.
DarkFrame at_masked_level(const DarkFrame& dark, const PerSite<double>& masked_dn);

}  // namespace lowlux::calib
