#pragma once

#include <array>
#include <cstdint>

#include "calib/chart/chart_grid.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// A raw frame at half size, in which charts are detected and measured: a pixel for each 2x2 cell of the mosaic, its R,
/// the mean of its two G, its B. Nothing is interpolated, so its pixels are independent.
struct ChartPicture {
  CameraRgb rgb;                // 0 black, 1 white level; signed
  Plane<std::uint8_t> clipped;  // 1 where one of the four codes reached the white level
};

/// Converts a mosaic to half size. An odd last row or column is left out.
/// @param mosaic active area of `raw`, black subtracted, gains applied
/// @param raw    a Bayer frame; its codes determine which pixels are clipped
ChartPicture chart_picture(const SignalFraction& mosaic, const RawDn& raw);

/// Measurement of one patch of a chart.
struct ChartPatch {
  Vector3 camera_rgb{};          // mean, 1 at the white level; signed
  Vector3 standard_error{};      // standard error of the mean, from the pixels' scatter
  double clipped_fraction = 0;   // fraction of its pixels; these are excluded from the mean
  double outlying_fraction = 0;  // more than five robust standard deviations off: hot pixels, dirt; excluded too
  int pixels = 0;                // number in the mean
};

/// Maximum clipped fraction of a usable patch: the remaining pixels of a clipped one are darker than the patch.
inline constexpr double max_clipped_fraction = 0.01;
/// Minimum number of pixels of a patch for a meaningful standard error.
inline constexpr int min_patch_pixels = 16;

/// Returns whether the mean represents the patch.
constexpr bool usable(const ChartPatch& patch) {
  return patch.clipped_fraction <= max_clipped_fraction && patch.pixels >= min_patch_pixels;
}

/// Returns the corners of the measured area of a patch, 0..23: the middle half of its cell's width and height.
std::array<PicturePoint, 4> measured_corners(const ChartGrid& grid, int patch);

/// Measures the patches in the chart's order, dark skin to black, each in the middle half of its cell's width and
/// height, further from borders than lenses blur. The grid must lie in the image.
std::array<ChartPatch, chart_patch_count> measure_patches(const ChartPicture& picture, const ChartGrid& grid);

/// Returns the median over usable patches of the largest relative standard error among R, G and B; infinite if a mean
/// is 0 or below, or none is usable. It bounds the effect of noise on a patch's colour.
double relative_error(const std::array<ChartPatch, chart_patch_count>& patches);

}  // namespace lowlux::calib
