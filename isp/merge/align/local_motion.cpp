#include "isp/merge/align/local_motion.h"

#include <algorithm>
#include <cmath>

#include "isp/merge/align/estimate.h"
#include "isp/merge/align/global_fit.h"

namespace lowlux::merge {
namespace {

constexpr double false_alarms = 0.01;          // of a frame in which nothing departs
constexpr double half_weight_chi_square = 25;  // of a tile against its block: 5 standard deviations
constexpr double max_error_cells = 1.0 / 3;
constexpr double min_information = 0.1;  // of what the gradients would have without noise

/// The departure of a block, and its variance.
struct Step {
  double dx_px = 0;
  double dy_px = 0;
  double variance_px2 = 0;
};

/// One size of blocks: squares of 2^shift tiles.
struct Blocks {
  int shift;
  int columns;
  int rows;
  std::vector<Step> steps;
  std::size_t index_of(int column, int row) const {
    return static_cast<std::size_t>(row >> shift) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column >> shift);
  }
};

Blocks blocks_of(const TileGrid& grid, int shift) {
  const int side = 1 << shift;
  Blocks blocks{shift, (grid.columns + side - 1) / side, (grid.rows + side - 1) / side, {}};
  blocks.steps.resize(static_cast<std::size_t>(blocks.columns) * static_cast<std::size_t>(blocks.rows));
  return blocks;
}

/// Adds a tile to the sum of its block, against the departure of the block above.
void add_tile(const TileFit& fit, const Step& above, bool is_alone, Measurement<2>& sum) {
  const auto score = residual_of(fit, above.dx_px, above.dy_px);
  const double w = is_alone ? 1 : 1 / (1 + chi_square_of(fit, score) / half_weight_chi_square);
  for (int i = 0; i < 2; ++i) {
    sum.score[i] += w * score[static_cast<std::size_t>(i)];
    for (int j = 0; j < 2; ++j) {
      const auto k = static_cast<std::size_t>(i + j);
      sum.information[i][j] += w * fit.information[k];
      sum.variance[i][j] += w * w * fit.variance[k];
    }
  }
}

/// Returns the departure of a block from the one above.
Step step_of(Measurement<2> sum, double threshold, double cell_px) {
  // Where the noise of the reference leaves little information, its error must not turn a sign.
  for (int i = 0; i < 2; ++i) {
    sum.information[i][i] = std::max(sum.information[i][i], min_information * sum.variance[i][i]);
  }
  const double prior = 1 / (cell_px * cell_px);
  const DisplacementEstimate<2> found = estimate<2>(sum, {prior, prior}, {}, max_error_cells * cell_px, 0);
  if (!(found.chi_square > threshold) || found.determined == 0) return {};
  return {found.value[0], found.value[1], (found.covariance[0][0] + found.covariance[1][1]) / 2};
}

}  // namespace

LocalMotion no_departure(const TileGrid& grid) {
  LocalMotion local;
  local.departure.spacing_px = grid.spacing_px();
  for (Plane<float>* plane : {&local.departure.dx_px, &local.departure.dy_px, &local.variance_px2}) {
    *plane = Plane<float>(grid.columns, grid.rows);
    std::fill_n(plane->data(), plane->size(), 0.0F);
  }
  return local;
}

LocalMotion resampled(const LocalMotion& local, const TileGrid& grid) {
  LocalMotion out = no_departure(grid);
  if (!local.any) return out;
  out.any = true;
  const int spacing = grid.spacing_px(), from = local.departure.spacing_px;
  const int last_x = from * (local.departure.dx_px.width() - 1), last_y = from * (local.departure.dx_px.height() - 1);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int x = std::min(column * spacing, last_x), y = std::min(row * spacing, last_y);
      const Shift shift = local.departure.at(static_cast<float>(x), static_cast<float>(y));
      out.departure.dx_px.at(column, row) = shift.dx_px;
      out.departure.dy_px.at(column, row) = shift.dy_px;
      out.variance_px2.at(column, row) = local.variance_px2.at((x + from / 2) / from, (y + from / 2) / from);
    }
  }
  return out;
}

void refer_to_global(const LocalMotion& local, const TileGrid& grid, std::vector<TileFit>& fits) {
  if (!local.any) return;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      TileFit& fit = fits[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                          static_cast<std::size_t>(column)];
      fit.score = residual_of(fit, -static_cast<double>(local.departure.dx_px.at(column, row)),
                              -static_cast<double>(local.departure.dy_px.at(column, row)));
    }
  }
}

LocalMotion find_departures(const GlobalMotion& motion, const MotionStep& step, const TileGrid& grid,
                            const std::vector<TileFit>& fits) {
  LocalMotion local = no_departure(grid);
  int shift = 0;
  while ((2 << shift) < std::max(grid.columns, grid.rows)) ++shift;  // blocks are halves of the frame at first
  std::vector<TileFit> residual = fits;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const auto slopes = motion.slopes_at(column * grid.spacing_px(), row * grid.spacing_px());
      std::array<double, 2> d{};
      for (int i = 0; i < motion_parameters; ++i) {
        d[0] += slopes[0][i] * step[i];
        d[1] += slopes[1][i] * step[i];
      }
      TileFit& fit = residual[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                              static_cast<std::size_t>(column)];
      fit.score = residual_of(fit, d[0], d[1]);
    }
  }
  const double all_blocks = 4.0 / 3 * static_cast<double>(fits.size());
  const double threshold = 2 * std::log(all_blocks / false_alarms);
  Blocks above = blocks_of(grid, shift + 1);
  for (; shift >= 0; --shift) {
    Blocks blocks = blocks_of(grid, shift);
    std::vector<Measurement<2>> sums(blocks.steps.size());
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const TileFit& fit = residual[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                                      static_cast<std::size_t>(column)];
        add_tile(fit, above.steps[above.index_of(column, row)], shift == 0, sums[blocks.index_of(column, row)]);
      }
    }
    for (int row = 0; row < blocks.rows; ++row) {
      for (int column = 0; column < blocks.columns; ++column) {
        const std::size_t at = blocks.index_of(column << shift, row << shift);
        const Step& start = above.steps[above.index_of(column << shift, row << shift)];
        const Step more = step_of(sums[at], threshold, grid.cell_px);
        blocks.steps[at] = {start.dx_px + more.dx_px, start.dy_px + more.dy_px,
                            more.variance_px2 > 0 ? more.variance_px2 : start.variance_px2};
      }
    }
    above = std::move(blocks);
  }
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Step& tile = above.steps[above.index_of(column, row)];
      if (tile.variance_px2 == 0) continue;
      local.any = true;
      local.departure.dx_px.at(column, row) = static_cast<float>(tile.dx_px);
      local.departure.dy_px.at(column, row) = static_cast<float>(tile.dy_px);
      local.variance_px2.at(column, row) = static_cast<float>(tile.variance_px2);
    }
  }
  return local;
}

}  // namespace lowlux::merge
