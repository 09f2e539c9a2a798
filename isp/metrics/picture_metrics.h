#pragma once

#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Holds an image in the two forms that are compared: as displayed, and as light.
struct RenderedPicture {
  SceneLinear display;  // linear Rec. 709, in 0..1
  SceneLinear light;    // linear Rec. 709, signed, nothing clipped; where only codes are known, `display`
};

/// Side of the patches whose mean light has a chromaticity, and of the box in which blotches are measured [px].
inline constexpr int metric_patch_px = 16;

/// A patch counts for the saturation ratio if its true chromaticity is at least this far from white in u'v': about
/// three just noticeable differences.
inline constexpr double coloured_patch_uv = 0.02;

/// Holds the truth that images are compared with, and everything that depends on it alone, computed once.
class PictureTruth {
 public:
  /// @param linear  Rec. 709 in 0..1, at least metric_patch_px wide and high
  PictureTruth(const RgbView<const float>& linear, Executor& executor);

  int width() const { return encoded_.width(); }
  int height() const { return encoded_.height(); }
  const SceneLinear& encoded() const { return encoded_; }  // sRGB code values, 0..1
  const SceneLinear& lab() const { return lab_; }          // CIELAB under D65
  const std::vector<Xyz>& patches() const { return patches_; }

 private:
  SceneLinear encoded_;
  SceneLinear lab_;
  std::vector<Xyz> patches_;
};

/// Measures the error of an image against the truth.
struct PictureError {
  double psnr_db = 0;           // PSNR of the sRGB code values of all channels, peak 1; infinite for equal images
  double ciede2000 = 0;         // mean over the pixels
  double chroma_rmse = 0;       // sqrt(mean(da*^2 + db*^2))
  double box_chroma_rmse = 0;   // RMSE of the means of a*, b* over boxes, which measures blotches
  double uv_shift = 0;          // median over patches of the distance in u'v'; infinite for a patch without a colour
  double saturation_ratio = 0;  // see saturation_ratio(); not a number where the truth has no coloured patch
};

/// Computes all errors. `picture` is as large as the truth; display values that are not in 0..1 count as the nearest.
PictureError picture_error(const RenderedPicture& picture, const PictureTruth& truth, Executor& executor);

/// Summarises CIEDE2000 over pixels or colours.
struct ColourDifference {
  double mean = 0;
  double largest = 0;
};

/// Computes CIEDE2000 of an image alone; display values as in picture_error.
ColourDifference display_difference(const RgbView<const float>& display, const PictureTruth& truth, Executor& executor);

/// Computes CIEDE2000 of colours against as many expected ones, at least one.
ColourDifference difference_of(std::span<const Lab> got, std::span<const Lab> expected);

/// Returns the mean X, Y, Z of each complete patch, row by row; the rest at the right and at the bottom is left out.
std::vector<Xyz> patch_means(const RgbView<const float>& linear);

/// Compares the saturation of patches with the truth, in u'v' about white (u0, v0), over the coloured patches p:
///     [ sum_p r_p . e_p / sum_p W_p ] / [ sum_p |t_p| / sum_p W(t)_p ],   r = (4 X - u0 W, 9 Y - v0 W),
/// W = X + 15 Y + 3 Z, t the true r, e = t / |t|. The ratio of the sums of light is computed last, so noise of zero
/// mean, however strong, does not change the expectation of either sum. It is 1 for the truth at any brightness; k for
/// chroma times k; where neutral light is added, its alpha. It is not a number without coloured patches, or where sum_p
/// W_p is not positive.
double saturation_ratio(const std::vector<Xyz>& patches, const std::vector<Xyz>& truth);

/// Returns the median distance in u'v' of patches from the truth's, over the patches whose truth has a chromaticity.
double median_uv_shift(const std::vector<Xyz>& patches, const std::vector<Xyz>& truth);

/// Returns the sRGB code, 0..1, of a display value of linear light; values not in 0..1 count as the nearest, NaN as 0.
float srgb_code(double display);

/// Returns -10 log10(mean squared difference) of code values [dB], all channels; infinite if they are equal.
double codes_psnr_db(const SceneLinear& codes, const SceneLinear& truth, Executor& executor);

/// Returns -10 log10(mean squared difference) of sRGB codes [dB], all channels; display values as in picture_error.
double encoded_psnr_db(const RgbView<const float>& display, const PictureTruth& truth, Executor& executor);

}  // namespace lowlux::isp
