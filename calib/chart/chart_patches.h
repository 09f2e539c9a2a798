#pragma once

#include <array>
#include <cstdint>

#include "calib/chart/chart_grid.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// A raw frame at half size, as charts are looked for and measured: a pixel for each 2x2 cell of the mosaic, its R,
/// the mean of its two G, its B. Nothing is interpolated, so its pixels are independent.
struct ChartPicture {
  CameraRgb rgb;                // 0 black, 1 white level; signed
  Plane<std::uint8_t> clipped;  // 1 where one of the four codes reached the white level
};

/// @param mosaic active area of `raw`, black off, gains applied
/// @param raw    a Bayer frame; its codes tell what is clipped
/// An odd last row or column is left out.
ChartPicture chart_picture(const SignalFraction& mosaic, const RawDn& raw);

/// What a camera makes of one patch of a chart.
struct ChartPatch {
  Vector3 camera_rgb{};          // mean, 1 at the white level; signed
  Vector3 standard_error{};      // of the mean, from the pixels' scatter
  double clipped_fraction = 0;   // of its pixels; these are not in the mean
  double outlying_fraction = 0;  // further than five robust standard deviations off: hot pixels, dirt; left out too
  int pixels = 0;                // in the mean
};

/// A patch of which more than this fraction is clipped: what is left of it is darker than the patch.
inline constexpr double most_clipped_fraction = 0.01;
/// Pixels a patch needs so that its standard error means something.
inline constexpr int least_patch_pixels = 16;

/// Whether the mean stands for the patch.
constexpr bool usable(const ChartPatch& patch) {
  return patch.clipped_fraction <= most_clipped_fraction && patch.pixels >= least_patch_pixels;
}

/// Corners of what is measured of a patch, 0..23: the middle half of its cell's width and height.
std::array<PicturePoint, 4> measured_corners(const ChartGrid& grid, int patch);

/// The patches in the chart's order, dark skin to black, each measured in the middle half of its cell's width and
/// height, which keeps away from borders by more than lenses blur. The grid must lie in the picture.
std::array<ChartPatch, chart_patch_count> measure_patches(const ChartPicture& picture, const ChartGrid& grid);

/// Median over usable patches of the largest relative standard error among R, G and B; infinite if a mean is 0 or
/// below, or none is usable. It bounds what noise does to a patch's colour.
double relative_error(const std::array<ChartPatch, chart_patch_count>& patches);

}  // namespace lowlux::calib
