#pragma once

#include <span>

#include "isp/base/executor.h"
#include "isp/bench/methods/method_scenes.h"
#include "isp/metrics/picture_metrics.h"

namespace lowlux::isp {

/// Scores of an image against the truth. Ratios are 1 for the truth; noise of zero mean does not change their
/// expectation.
struct MethodScore {
  PictureError error;       // its saturation_ratio is the saturation that is kept
  double chroma_bias = 0;   // length of the mean difference in a*, b* over all pixels: a tint
  double texture_kept = 0;  // see texture_kept()
  double stars_kept = 0;    // see stars_kept(); not a number without stars
};

/// Returns the slope of fine luma detail over that of the truth: sum h h_t / sum h_t^2, where h is the luma of sRGB
/// codes less its mean over 5 x 5 pixels. Not a number for a truth without detail.
/// @param codes, truth  sRGB code values, of one size
double texture_kept(const SceneLinear& codes, const SceneLinear& truth);

/// Returns the light of all stars, over that of the truth: sums over 5 x 5 pixels of luminance above the mean of the
/// ring around them, of 4 to 6 px. Stars closer than 6 px to an edge are left out.
/// @param light, truth  linear Rec. 709, of one size
double stars_kept(const SceneLinear& light, const SceneLinear& truth, std::span<const StarPlace> stars);

/// Computes all scores.
MethodScore score_of(const RenderedPicture& picture, const PictureTruth& truth, const MethodScene& scene,
                     Executor& executor);

}  // namespace lowlux::isp
