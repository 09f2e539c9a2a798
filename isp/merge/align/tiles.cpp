#include "isp/merge/align/tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lowlux::merge {
namespace {

constexpr int min_tile_cells = 8;

/// For normal differences r with unit variance and weights q = 1 / (1 + r^2 / student): integrals that
/// tests/merge/tiles_test.cpp computes.
constexpr double mean_weight = 0.931823;     // E[q]
constexpr double score_variance = 0.682220;  // E[r^2 q^2]
constexpr double score_slope = 0.818120;     // E[d(r q) / dr] = E[r^2 q]

/// Variance of the mean of r^2 q / score_slope over n cells, times n: E[r^4 q^2] / score_slope^2 - 1.
constexpr double chi_square_variance = 1.436508;
/// Cells whose differences are alike where structure does not match: aliasing, moving objects.
constexpr double excess_correlation = 16;

/// Standard deviation of what aliasing and interpolation displace a tile by; an assumption, see isp/merge/README.md.
constexpr double own_error_cells = 0.02;
/// Cells of a tile below which its sums say nothing: a quarter of the smallest tile.
constexpr double min_cells = 16;

/// Displacements of one row of cells, and the frame's rows of a row of tiles, displaced.
struct Scratch {
  std::vector<float> node_x, node_y;  // displacements of the row at the nodes [cell]
  std::vector<float> dx, dy;
  Plane<float> strip;
};

Scratch scratch_for(const TileGrid& grid, const LumaLevel& level) {
  const auto nodes = static_cast<std::size_t>(grid.columns), width = static_cast<std::size_t>(level.width());
  Scratch scratch{std::vector<float>(nodes), std::vector<float>(nodes), std::vector<float>(width),
                  std::vector<float>(width), Plane<float>(level.width() + 2 * LumaLevel::border, grid.cells + 2)};
  std::fill_n(scratch.strip.data(), scratch.strip.size(), std::numeric_limits<float>::quiet_NaN());
  return scratch;
}

/// Writes the displacements of row y of cells: bilinear between the nodes. The centre of cell x lies half a cell less
/// half a pixel after pixel x cell_px.
void displacements_of_row(const Motion& motion, const TileGrid& grid, int y, Scratch& scratch) {
  const int n = grid.cells, upper = std::clamp(y / n, 0, grid.rows - 2);
  const float cell = static_cast<float>(grid.cell_px), centre = (cell - 1) / (2 * cell);
  const float v = (static_cast<float>(y - upper * n) + centre) / static_cast<float>(n);
  for (int i = 0; i < grid.columns; ++i) {
    const auto at = static_cast<std::size_t>(i);
    scratch.node_x[at] = ((1 - v) * motion.dx_px.at(i, upper) + v * motion.dx_px.at(i, upper + 1)) / cell;
    scratch.node_y[at] = ((1 - v) * motion.dy_px.at(i, upper) + v * motion.dy_px.at(i, upper + 1)) / cell;
  }
  const int width = static_cast<int>(scratch.dx.size());
  for (int x0 = 0, i = 0; x0 < width; x0 += n, ++i) {
    const auto at = static_cast<std::size_t>(i);
    const float first_x = scratch.node_x[at], step_x = (scratch.node_x[at + 1] - first_x) / static_cast<float>(n);
    const float first_y = scratch.node_y[at], step_y = (scratch.node_y[at + 1] - first_y) / static_cast<float>(n);
    const int count = std::min(n, width - x0);
    float* const dx = scratch.dx.data() + x0;
    float* const dy = scratch.dy.data() + x0;
    for (int k = 0; k < count; ++k) {
      const float steps = static_cast<float>(k) + centre;
      dx[k] = first_x + steps * step_x;
      dy[k] = first_y + steps * step_y;
    }
  }
}

void measure_row_of_tiles(const LevelPair& pair, const Motion& motion, const rows::CellNoise& noise, int row,
                          TileGrid& grid, Scratch& scratch) {
  const LumaLevel& reference = *pair.reference;
  const LumaLevel& frame = *pair.frame;
  const rows::Samples source{frame.row(0), frame.stride(), frame.width(), frame.height()};
  const int n = grid.cells, width = reference.width();
  const int first = std::max(0, row * n - n / 2), last = std::min(reference.height(), row * n + n / 2);
  for (int y = first - 1; y <= last; ++y) {  // with the neighbours of the first row and the last
    displacements_of_row(motion, grid, y, scratch);
    rows::sample_row(source, 0, y, scratch.dx.data(), scratch.dy.data(), width,
                     scratch.strip.row(y - first + 1) + LumaLevel::border);
  }
  for (int column = 0; column < grid.columns; ++column) {
    auto& tile = grid.tiles[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                            static_cast<std::size_t>(column)];
    tile.fill(0);
    for (int x = column * n - n / 2; x < column * n + n / 2; x += min_tile_cells) {
      if (x + min_tile_cells <= 0 || x >= width || first >= last) continue;
      rows::add_tile(reference.row(first) + x, reference.stride(), scratch.strip.row(1) + LumaLevel::border + x,
                     scratch.strip.width(), last - first, noise, tile.data());
    }
  }
}

}  // namespace

TileGrid tile_grid(const LumaLevel& level, int spacing_px) {
  TileGrid grid;
  grid.cell_px = level.cell_px();
  grid.cells = std::max(min_tile_cells, spacing_px / level.cell_px());
  const auto nodes = [&](int size) { return std::max(2, (size + grid.cells - 1) / grid.cells + 1); };
  grid.columns = nodes(level.width());
  grid.rows = nodes(level.height());
  grid.tiles.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows));
  return grid;
}

rows::CellNoise cell_noise(const LevelPair& pair, double warp_error_cells) {
  const double pixels = static_cast<double>(pair.reference->cell_px()) * pair.reference->cell_px();
  const double light = pair.light, squared = light * light;
  return {.light = static_cast<float>(light),
          .slope = static_cast<float>((light + squared) / pixels),
          .steady_e2 = static_cast<float>((pair.frame_variance_e2 + squared * pair.reference_variance_e2) / pixels),
          .min_mean_e = static_cast<float>(0.25 / pixels),  // one electron in all pixels of the four neighbours
          .warp_variance_cells = static_cast<float>(warp_error_cells * warp_error_cells),
          .reference_slope = static_cast<float>(squared / pixels),
          .reference_steady_e2 = static_cast<float>(squared * pair.reference_variance_e2 / pixels)};
}

void measure_tiles(const LevelPair& pair, const Motion& motion, double warp_error_cells, TileGrid& grid,
                   Executor& executor) {
  const rows::CellNoise noise = cell_noise(pair, warp_error_cells);
  const int tasks = std::min(grid.rows, executor.width());
  for_each_index(executor, tasks, [&](int task) {
    Scratch scratch = scratch_for(grid, *pair.reference);
    for (int row = task * grid.rows / tasks; row < (task + 1) * grid.rows / tasks; ++row) {
      measure_row_of_tiles(pair, motion, noise, row, grid, scratch);
    }
  });
}

TileFit fit_of(const std::array<float, rows::sums>& tile, int cell_px) {
  const auto sum = [&](int figure) { return static_cast<double>(tile[static_cast<std::size_t>(figure)]); };
  const double n = sum(rows::count);
  if (n < min_cells) return {};
  // Differences that remain after the best displacement by the gradients.
  const double bx = sum(rows::score_x), by = sum(rows::score_y);
  const double xx = sum(rows::gradient_xx), xy = sum(rows::gradient_xy), yy = sum(rows::gradient_yy);
  const double determinant = xx * yy - xy * xy;
  const double explained =
      determinant > 1e-6 * xx * yy ? (yy * bx * bx - 2 * xy * bx * by + xx * by * by) / determinant : 0;
  const double chi_square = std::max(0.0, sum(rows::square) - explained) / (score_slope * n);
  const double excess = std::max(0.0, chi_square - 1 - 2 * std::sqrt(chi_square_variance / n));
  const double unit = 1.0 / cell_px, scale = 1 / (1 + excess_correlation * excess);
  const double slope = scale * unit * unit * score_slope / mean_weight;
  const double variance = scale * unit * unit * score_variance / mean_weight;
  const double kxx = slope * sum(rows::slope_xx), kxy = slope * sum(rows::slope_xy), kyy = slope * sum(rows::slope_yy);
  const double own = own_error_cells * own_error_cells / (unit * unit);  // px^2
  return {.score = {scale * unit * bx, scale * unit * by},
          .information = {kxx, kxy, kyy},
          .variance = {variance * xx + own * (kxx * kxx + kxy * kxy), variance * xy + own * kxy * (kxx + kyy),
                       variance * yy + own * (kyy * kyy + kxy * kxy)}};
}

}  // namespace lowlux::merge
