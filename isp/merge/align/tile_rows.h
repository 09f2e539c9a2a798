#pragma once

#include <cstddef>

#include "isp/merge/samples.h"

/// The kernels under measure_tiles and MotionComparison, with plain types only: their source is compiled for several
/// instruction sets.
namespace lowlux::merge::rows {

/// Interpolates a level of a pyramid (see LumaLevel) at (x0 + i + dx[i], y + dy[i]), i = 0..count - 1, by cubic
/// Lagrange polynomials through 4 x 4 cells, whose phase error is a fifth of that of bilinear weights and of cubic
/// convolution at a period of 6 cells. NaN where one of the cells does not exist. Displacements are at most 1e6 cells.
void sample_row(const Samples& level, int x0, int y, const float* dx, const float* dy, int count, float* out);

/// How a difference of a cell d = frame - light * reference is weighted. With m the mean of the reference's four
/// neighbours, at least min_mean_e, and g = light * gradient of the reference:
///     V = slope m + steady_e2 + warp_error^2 |g|^2,   w = 1 / (V + d^2 / student)
struct CellNoise {
  float light;
  float slope;      // variance for each electron of m
  float steady_e2;  // variance at m = 0
  float min_mean_e;
  float warp_variance_cells;  // square of the expected error of the displacement, for each axis
  float reference_slope;      // slope and steady variance of light * reference alone
  float reference_steady_e2;
};

/// Degrees of freedom of Student's t, whose likelihood the weights maximise, less one: differences of sqrt(12) = 3.5
/// standard deviations have half of the weight.
inline constexpr float student = 12;

/// Sums over the cells of a tile, of which all but `count` have the weight w.
enum TileSum : int {
  score_x,  // -g_x d: derivative of the log-likelihood with respect to the displacement [1/cell]
  score_y,
  gradient_xx,  // g_x g_x of the reference [1/cell^2], which contains its noise
  gradient_xy,
  gradient_yy,
  slope_xx,  // sums of products of slopes of reference and frame, whose noise is independent [1/cell^2]
  slope_xy,
  slope_yy,
  noise,        // variance of light * reference
  square,       // d^2
  light_score,  // reference * d
  light_info,   // reference^2
  count,        // cells that have a value in both frames
  sums
};

/// Adds the sums of columns x0..x0 + 7 of `rows` rows of a tile.
/// @param reference  column x0 of the first row, with `stride` cells from row to row; neighbours on all sides exist
/// @param frame      the same of the frame, displaced, with `frame_stride`
/// @param out        `sums` numbers, to which the sums of the 8 columns are added in a fixed order
void add_tile(const float* reference, std::ptrdiff_t stride, const float* frame, std::ptrdiff_t frame_stride, int rows,
              const CellNoise& noise, float* out);

/// Coefficients of the cost of a row of cells for a value f of the frame: constant - linear f + square f^2.
struct CostRow {
  const float* constant;
  const float* linear;
  const float* square;
};

/// Returns the sum of the costs of a row, each at most max_cost. Cells that the frame does not have cost nothing.
float capped_cost(const float* frame, const CostRow& cost, float max_cost, int count);

}  // namespace lowlux::merge::rows
