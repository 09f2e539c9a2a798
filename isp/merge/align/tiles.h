#pragma once

#include <array>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/align/luma_pyramid.h"
#include "isp/merge/align/tile_rows.h"
#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Sums of each tile of a level, row by row. Tile (column, row) is centred on the node of a Motion with the same
/// spacing.
struct TileGrid {
  int columns = 0;
  int rows = 0;
  int cells = 8;  // side of a tile in cells
  int cell_px = 2;
  std::vector<std::array<float, rows::sums>> tiles;

  int spacing_px() const { return cells * cell_px; }
};

/// Returns the grid of a level: tiles of at least 8 x 8 cells whose spacing is at least spacing_px, a multiple of 16.
/// Nodes reach to the far edges or beyond, and there are at least two each way.
TileGrid tile_grid(const LumaLevel& level, int spacing_px);

/// The two levels that are compared, and how noisy they are; light is the expected ratio of frame to reference.
struct LevelPair {
  const LumaLevel* reference;
  const LumaLevel* frame;
  double reference_variance_e2;  // LumaPyramid::variance_e2
  double frame_variance_e2;
  double light;
};

/// Returns the weights' parameters of a pair of levels.
/// @param warp_error_cells  expected error of the displacement, for each axis
rows::CellNoise cell_noise(const LevelPair& pair, double warp_error_cells);

/// Compares the frame, displaced by a motion, with the reference, and sums over the tiles of a grid.
/// @param motion  nodes of the grid's spacing
void measure_tiles(const LevelPair& pair, const Motion& motion, double warp_error_cells, TileGrid& grid,
                   Executor& executor);

/// The quadratic log-likelihood of a displacement of one tile, relative to the motion it was measured with:
/// score has the mean information * displacement and the covariance `variance`. Unit: pixels.
struct TileFit {
  std::array<double, 2> score{};        // [1/px]
  std::array<double, 3> information{};  // xx, xy, yy [1/px^2], may be negative where there is only noise
  std::array<double, 3> variance{};     // variance of the score [1/px^2]
};

/// Returns the fit of a tile. The information is the sum of products of slopes of reference and frame, in which noise
/// has the mean zero; the variance of the score contains the noise of the gradient. Both are corrected for the weights
/// of Student's t. Where the differences that the best displacement leaves are larger than noise explains (by 2
/// standard deviations), all three are divided by 1 + 16 excess, as if noise were so much larger: such differences are
/// alike in some 16 neighbouring cells. Aliasing and interpolation add a standard deviation of 0.02 cells to a tile's
/// displacement. Tiles of fewer than 16 cells have no information.
TileFit fit_of(const std::array<float, rows::sums>& tile, int cell_px);

}  // namespace lowlux::merge
