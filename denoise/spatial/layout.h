#pragma once

#include <algorithm>

#include "isp/base/cfa.h"

/// Sizes and places that the denoiser and its reference have to agree on: integers only.
namespace lowlux::denoise {

inline constexpr int block = 8;             // cells, each way
inline constexpr int most_levels = 5;       // of the pyramid
inline constexpr int largest_side = 65536;  // sites
inline constexpr int tile = 64;             // cells at the finest level, each way

/// Pyramid levels of a mosaic of columns x rows cells: the coarsest holds one block at least.
constexpr int levels_of(int columns, int rows) {
  int levels = 1;
  while (levels < most_levels && (block << levels) <= std::min(columns, rows)) ++levels;
  return levels;
}

/// Cells after mirrored ones are appended, so that on each level the blocks, 4 cells apart, end with the last cell.
constexpr int padded(int cells, int levels) {
  const int unit = 4 << (levels - 1);
  return std::max(block, (cells + unit - 1) / unit * unit);
}

/// Index into 0..n-1 of any i: mirrored with the edge repeated, which keeps whole cells.
constexpr int mirrored(int i, int n) {
  const int folded = ((i % (2 * n)) + 2 * n) % (2 * n);
  return folded < n ? folded : 2 * n - 1 - folded;
}

/// Raw column or row `site` (0 or 1) of cell `cell`: where the mosaic ends in half a cell, the cell before.
constexpr int raw_of(int cell, int site, int size) {
  const int at = 2 * cell + site;
  return at < size ? at : at - 2;
}

/// Tiles along `cells` cells; the last is the larger.
constexpr int tiles_of(int cells) { return std::max(1, cells / tile); }
constexpr int tile_of(int cell, int tiles) { return std::min(cell / tile, tiles - 1); }

/// Sites of R, G in the row of red, G in the row of blue, B.
constexpr PerSite<int> sites_of(BayerPhase phase) {
  const int red = site_of(red_column(phase), red_row(phase));
  return {red, red ^ 1, red ^ 2, red ^ 3};
}

}  // namespace lowlux::denoise
