#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/metrics/gamut_ratio.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// CIELAB of every pixel, row by row, under D65 at Y = 1. X, Y or Z below 0 lies on the straight part of the curve.
/// @param xyz  X, Y, Z planes
std::vector<Lab> lab_of_picture(const SceneLinear& xyz);

/// Mean of delta_e_94c over the pixels that are finite in both; not a number if there are none.
/// @param test  as many as `reference`
double mean_delta_e_94c(std::span<const Lab> reference, std::span<const Lab> test);

/// How large a colour difference is over the pixels of a picture; not numbers if there are none.
struct DifferenceSummary {
  double mean = 0;
  double median = 0;         // the least that half of the pixels do not exceed
  double percentile_95 = 0;  // the least that 95 % of them do not exceed
  double largest = 0;
};

/// Of finite values, whose order it changes.
DifferenceSummary summary_of(std::span<float> differences);

/// A pixel is outside of the display's range if linear R, G or B of Rec. 709 is this far from 0..1: more than the
/// rounding of ICC profiles does, whose colorants have steps of 1/65536, and less than half an 8-bit code anywhere.
inline constexpr double display_tolerance = 1e-4;

/// How far a picture is from a reference.
struct PictureComparison {
  DifferenceSummary delta_e_ab;
  DifferenceSummary delta_e_94c;
  DifferenceSummary ciede2000;
  GamutRatio gamut;
  /// Of sRGB code values of all channels, peak 1 [dB]; infinite if they are equal. Values that a display has not count
  /// as the nearest it has, and NaN as 0.
  double psnr_db = 0;
  /// Of the same codes, weighted to one by Rec. 709's 0.2126, 0.7152, 0.0722; nullopt below 11 x 11 pixels.
  std::optional<double> ssim;
  std::uint64_t pixels = 0;
  std::uint64_t not_finite = 0;                           // of either picture: in no difference of colour
  std::uint64_t reference_outside = 0, test_outside = 0;  // of the display's range: clipped for PSNR and SSIM
  std::uint64_t reference_beyond = 0, test_beyond = 0;    // of the gamut's reach: not in the gamut ratio
};

/// Everything `lowlux compare` says.
/// @param reference_xyz, test_xyz  X, Y, Z planes of one size, not empty, D65 at Y = 1 their white
PictureComparison compare_pictures(const SceneLinear& reference_xyz, const SceneLinear& test_xyz, Executor& executor);

}  // namespace lowlux::isp
