#pragma once

#include <cstddef>
#include <cstdint>

/// The kernels under FrameMotion, with plain types only, as in rows.h. They compare rows of 2x2 cells, whose signals
/// are stabilised and rounded, so that all sums are integers and the same for every instruction set.
namespace lowlux::denoise::rows {

inline constexpr int units_per_sigma = 4;  // standard deviation of the noise of a stabilised cell
inline constexpr int max_difference = 64;  // largest difference of two cells that counts [units]
inline constexpr int tile_cells = 16;      // side of a tile
inline constexpr int block_cells = 4;      // side of a block of 8 x 8 sites

/// Two rows of a mosaic.
struct StabiliseRow {
  const float* upper;
  const float* lower;
  int cells;
  float dark_e[4];  // dark charge of the sites, in the order of site_of()
  float offset_e2;  // sum of the variances of the four sites without light, > 0
};
/// Writes 2 units_per_sigma sqrt(S + offset_e2) for each cell, with S the sum of the signals of its sites: noise of the
/// variance S + offset_e2 then has a standard deviation of units_per_sigma.
void stabilise_row(const StabiliseRow& in, std::int16_t* out);

/// A rectangle of cells of a frame, and where it is compared with in the mean.
struct CellPair {
  const std::int16_t* frame;
  std::ptrdiff_t frame_stride;
  const std::int16_t* mean;
  std::ptrdiff_t mean_stride;
};
/// Returns the sum of squared differences, each limited to max_difference.
std::int64_t squared_difference(const CellPair& at, int width, int height);

/// Sums over the 4 x 4 cells of a block, with g the difference of the mean's next and previous cell along each axis,
/// and d that of frame and mean. Differences are limited to 2047.
struct BlockSlopes {
  std::int32_t xx, xy, yy;  // g g'
  std::int32_t xd, yd;      // g d
};
/// Writes the sums of blocks side by side. Reads one more cell of the mean on all sides, and up to tile_cells of a row.
/// @param blocks  1..4
void block_slopes(const CellPair& at, int blocks, BlockSlopes* out);

}  // namespace lowlux::denoise::rows
