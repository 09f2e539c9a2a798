#pragma once

#include <span>

#include "isp/base/plane.h"

namespace lowlux {

/// States how the noise of a frame differs from place to place, as in a mean of several frames of which fewer match in
/// some places: the variance of a value is the ratio of its block times that of the frame's NoiseProfile.
struct NoiseRatio {
  int block_px = 16;   // side of a block
  Plane<float> ratio;  // > 0; one for each block from the corner of the active area, those at its far edges included
};

/// Returns the number of blocks along `px` pixels, of which there may be as many as an int holds.
constexpr int ratio_blocks(int px, int block_px) { return px / block_px + (px % block_px != 0 ? 1 : 0); }

/// Borrows the noise ratio of a region of a frame. Pixels count from the corner of the region; beyond the blocks, the
/// nearest one holds.
struct NoiseRatioView {
  PlaneView<const float> ratio;  // no data: the ratio is 1 everywhere; else at least one block
  int block_px = 16;
  int x_px = 0;  // corner of the region, from that of the first block
  int y_px = 0;

  bool is_one() const { return ratio.data == nullptr; }
  /// Returns the view of a region whose corner is pixel (x, y) of this one.
  NoiseRatioView from(int x, int y) const { return {ratio, block_px, x_px + x, y_px + y}; }
  /// Returns the ratio of a pixel.
  float at(int x, int y) const;
  /// Computes the ratio of pixels first, first + step ... of row y. Precondition: step > 0.
  void row(int first, int step, int y, std::span<float> out) const;
  /// Returns the largest ratio of all blocks, whatever the region.
  float largest() const;
  /// Returns the mean over a rectangle of pixels, which is not empty.
  double mean(int x, int y, int width, int height) const;
};

/// Returns a view of the ratio of a whole frame; without data if there is none.
NoiseRatioView view_of(const NoiseRatio* ratio);

/// Returns the median over the blocks: of an even number, the larger of the two in the middle; 1 without a ratio.
double median_ratio(const NoiseRatio* ratio);

}  // namespace lowlux
