#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/metrics/gamut_ratio.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Side of the window of SSIM [px].
inline constexpr int ssim_window_px = 11;

/// Returns the structural similarity, mean over all windows completely inside the planes (Wang, Bovik, Sheikh &
/// Simoncelli, IEEE Trans. Image Process. 13 (2004) 600-612, Eq. 13): Gaussian windows of 11 x 11 px, standard
/// deviation 1.5 px, K1 = 0.01, K2 = 0.03, of values in 0..1; variances of the window without correction for bias.
/// @return 1 for equal planes; nullopt where no window fits. The planes are of one size.
std::optional<double> ssim(const PlaneView<const float>& first, const PlaneView<const float>& second,
                           Executor& executor);

/// Returns the mean of delta_e_94c over the pixels that are finite in both; not a number if there are none.
/// @param test  as many as `reference`
double mean_delta_e_94c(std::span<const Lab> reference, std::span<const Lab> test);

/// Summarises colour differences over the pixels of an image; the values are not numbers if there are none.
struct DifferenceSummary {
  double mean = 0;
  double median = 0;         // minimum value that half of the pixels do not exceed
  double percentile_95 = 0;  // minimum value that 95 % of the pixels do not exceed
  double largest = 0;
};

/// Summarises finite values, whose order it changes.
DifferenceSummary summary_of(std::span<float> differences);

/// A pixel is outside the display's range if linear R, G or B of Rec. 709 is more than this outside 0..1: more than the
/// rounding of ICC profiles causes, whose colorants have steps of 1/65536, and less than half an 8-bit code anywhere.
inline constexpr double display_tolerance = 1e-4;

/// Compares an image with a reference.
struct PictureComparison {
  DifferenceSummary delta_e_ab;
  DifferenceSummary delta_e_94c;
  DifferenceSummary ciede2000;
  GamutRatio gamut;
  /// PSNR of sRGB code values of all channels, peak 1 [dB]; infinite if they are equal. Values outside the display's
  /// range count as the nearest inside, and NaN as 0.
  double psnr_db = 0;
  /// SSIM of the sRGB codes, weighted to one by Rec. 709's 0.2126, 0.7152, 0.0722; nullopt below 11 x 11 pixels.
  std::optional<double> ssim;
  std::uint64_t pixels = 0;
  std::uint64_t not_finite = 0;                           // pixels of either image that are in no colour difference
  std::uint64_t reference_outside = 0, test_outside = 0;  // pixels outside the display's range: clipped for PSNR, SSIM
  std::uint64_t reference_beyond = 0, test_beyond = 0;    // pixels beyond the gamut's reach: not in the gamut ratio
};

/// Computes everything `lowlux compare` reports.
/// @param reference_xyz, test_xyz  X, Y, Z planes of one size, not empty, D65 at Y = 1 their white
PictureComparison compare_pictures(const SceneLinear& reference_xyz, const SceneLinear& test_xyz, Executor& executor);

}  // namespace lowlux::isp
