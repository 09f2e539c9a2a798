#pragma once

#include <string_view>

#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// How far two pictures are apart as seen from some distance: CIEDE2000 between the means of their light over 8 x 8
/// pixels around each pixel (isp/pipeline/budget/visible_noise.h), the squares that lie wholly in the picture.
struct SeenDifference {
  double mean = 0;
  double percentile95 = 0;
  double largest = 0;
};

/// @param first, second  linear Rec. 709 as displayed, 0..1; of one size, at least 8 x 8
SeenDifference seen_difference(const RgbView<const float>& first, const RgbView<const float>& second,
                               Executor& executor);

/// Of 8-bit sRGB codes.
SeenDifference seen_difference(const Encoded8& first, const Encoded8& second, Executor& executor);

/// The light that sRGB codes stand for, linear Rec. 709.
SceneLinear light_of_codes(const Encoded8& codes);

}  // namespace lowlux::isp
