#pragma once

#include <algorithm>

#include "isp/base/cfa.h"

/// Integer sizes and positions that the denoiser and its reference must agree on.
namespace lowlux::denoise {

inline constexpr int block = 8;             // cells, each way
inline constexpr int max_levels = 5;        // levels of the pyramid
inline constexpr int largest_side = 65536;  // sites
inline constexpr int tile = 64;             // cells at the finest level, each way

/// Returns the number of pyramid levels of a mosaic of columns x rows cells: the coarsest holds at least one block.
constexpr int levels_of(int columns, int rows) {
  int levels = 1;
  while (levels < max_levels && (block << levels) <= std::min(columns, rows)) ++levels;
  return levels;
}

/// Returns the power of the luma-shaped spectrum that is expected of chroma, over that of the chroma that is known. On
/// the coarsest level it is 0: blocks are as wide as the margin of a tile there, and would carry what lies behind it
/// into the tile.
constexpr float luma_shaped_power(int level, int levels) { return level + 1 == levels ? 0.0f : 3.0f; }

/// Factors of the squared coefficients of pass 1 that pass 2 takes for the power of the signal. These contain noise,
/// most of it near the thresholds, which noise helps to pass. Chroma of coarser levels has factor 1, because less would
/// take saturation from patches of faint colour. Chosen by a script on the tuning set, and confirmed on eight other
/// images, of 1 to 200 e- over 2 and 200 e-: 0.75 adds 0.05 and 0.08 dB, 0.65 up to 0.03 dB more, but with it the edges
/// of blocks exceed the remaining noise by more.
inline constexpr float pilot_power_of_luma = 0.75f;
constexpr float pilot_power_of_chroma(int level) { return level < 2 ? 0.75f : 1.0f; }

/// Returns the number of cells after mirrored ones are appended, so that on each level the blocks, 4 cells apart, end
/// with the last cell.
constexpr int padded(int cells, int levels) {
  const int unit = 4 << (levels - 1);
  return std::max(block, (cells + unit - 1) / unit * unit);
}

/// Returns the index in 0..n-1 for any i: mirrored with the edge repeated, which keeps cells complete.
constexpr int mirrored(int i, int n) {
  const int folded = ((i % (2 * n)) + 2 * n) % (2 * n);
  return folded < n ? folded : 2 * n - 1 - folded;
}

/// Returns the raw column or row of `site` (0 or 1) of cell `cell`; where the mosaic ends in half a cell, that of the
/// previous cell.
constexpr int raw_of(int cell, int site, int size) {
  const int at = 2 * cell + site;
  return at < size ? at : at - 2;
}

/// Returns the number of tiles along `cells` cells; the last tile is the largest.
constexpr int tiles_of(int cells) { return std::max(1, cells / tile); }
constexpr int tile_of(int cell, int tiles) { return std::min(cell / tile, tiles - 1); }

/// Squares of cells over which means are kept: 16 cells each way, so that cells of level 0 lie in them as those of
/// level `mean_grid` lie in tiles. The last square is the largest.
inline constexpr int mean_grid = 2;
inline constexpr int mean_square = tile >> mean_grid;
constexpr int squares_of(int cells) { return std::max(1, cells / mean_square); }

/// Returns the sites of R, G in the row of red, G in the row of blue, and B.
constexpr PerSite<int> sites_of(BayerPhase phase) {
  const int red = site_of(red_column(phase), red_row(phase));
  return {red, red ^ 1, red ^ 2, red ^ 3};
}

}  // namespace lowlux::denoise
