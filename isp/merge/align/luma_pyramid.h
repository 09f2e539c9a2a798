#pragma once

#include <cstddef>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"

namespace lowlux::merge {

/// One level of a pyramid of luma: means of squares of cell_px x cell_px pixels, in electrons per pixel. A missing
/// value is NaN. Cells without a value surround the level, so that filters and interpolation need no code for borders.
class LumaLevel {
 public:
  static constexpr int border = 16;      // columns without a value on each side, at least
  static constexpr int border_rows = 4;  // rows without a value above and below

  LumaLevel(int width, int height, int cell_px);

  int width() const { return width_; }
  int height() const { return height_; }
  int cell_px() const { return cell_px_; }
  std::ptrdiff_t stride() const { return cells_.width(); }
  /// Returns cell (0, y) of rows -border_rows..height + border_rows - 1; columns -border..width + border - 1 exist.
  float* row(int y) { return cells_.row(y + border_rows) + border; }
  const float* row(int y) const { return cells_.row(y + border_rows) + border; }

 private:
  Plane<float> cells_;
  int width_ = 0;
  int height_ = 0;
  int cell_px_ = 2;
};

/// Luma of a frame at all scales, finest level (cells of 2 x 2 pixels) first.
struct LumaPyramid {
  std::vector<LumaLevel> levels;
  double variance_e2 = 0;  // variance of a pixel without light: mean of the four sites
  /// Returns the variance of a cell whose pixels have the expected value mean_e:
  ///     Var = (max(mean_e, 0) + variance_e2) / cell_px^2
  double variance_of(double mean_e, int cell_px) const {
    return ((mean_e > 0 ? mean_e : 0) + variance_e2) / (static_cast<double>(cell_px) * cell_px);
  }
};

/// Makes the pyramid of a frame. Luma is (R + G1 + G2 + B) / 4 of a 2x2 cell of the mosaic: every colour has the same
/// weight in every cell, so that a missing site does not change the colour that luma is sensitive to. One missing green
/// counts as the other; a cell without red or blue or any green is missing. Missing cells of the finest level that lie
/// between valid ones (single defects, one row or column) are filled with the mean of opposite neighbours. A cell of a
/// coarser level is the mean of those of its four cells that exist, at least two. Levels end where the longer side has
/// at most 64 cells, or the shorter one fewer than 24. Frames of fewer than 2 pixels in width or height have no level.
LumaPyramid make_luma_pyramid(const FrameView& frame, Executor& executor);

}  // namespace lowlux::merge
