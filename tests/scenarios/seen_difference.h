#pragma once

#include <string_view>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// How far two pictures are apart as seen from some distance: CIEDE2000 between the means of their light over 8 x 8
/// pixels around each pixel (isp/pipeline/budget/visible_noise.h), the squares that lie wholly in the picture.
struct SeenDifference {
  double mean = 0;
  double percentile95 = 0;
  double largest = 0;
};

/// @param first, second  linear Rec. 709 as displayed, 0..1; of one size, at least 8 x 8
/// @param row_step       squares start in every row, or in one of so many: percentiles of large images hardly change
SeenDifference seen_difference(const RgbView<const float>& first, const RgbView<const float>& second,
                               Executor& executor, int row_step = 1);

/// Of 8-bit sRGB codes.
SeenDifference seen_difference(const Encoded8& first, const Encoded8& second, Executor& executor);

/// How far lines of two pictures are apart: CIEDE2000 between the means of their light over 256 x 1 and 1 x 256 pixels,
/// end to end, the segments that lie wholly in the picture. Means over 8 x 8 pixels hide all but a square root of 8 of
/// what a line differs by.
SeenDifference line_difference(const RgbView<const float>& first, const RgbView<const float>& second);

/// CIEDE2000 between two pictures at single pixels.
class PixelDifference {
 public:
  PixelDifference(const RgbView<const float>& first, const RgbView<const float>& second);
  double at(int x, int y) const;
  /// The largest around a pixel: of 17 x 17 pixels without the middle 5 x 5.
  double around(int x, int y) const;

 private:
  RgbView<const float> first_, second_;
  Matrix3 to_xyz_;
  Xyz white_;
};

/// The light that sRGB codes stand for, linear Rec. 709.
SceneLinear light_of_codes(const Encoded8& codes);

}  // namespace lowlux::isp
