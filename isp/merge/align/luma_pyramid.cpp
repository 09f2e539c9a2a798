#include "isp/merge/align/luma_pyramid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isp/merge/align/luma_rows.h"

namespace lowlux::merge {
namespace {

constexpr float missing = std::numeric_limits<float>::quiet_NaN();
constexpr int max_coarsest_side = 64;  // cells of the longer side at which the pyramid ends
constexpr int min_side_to_halve = 24;  // cells of the shorter side
constexpr int min_pairs = 2;           // opposite neighbours that a missing cell is filled from
constexpr int rows_of_a_task = 16;

/// The value of a missing cell, and where it is.
struct Fill {
  int x;
  int y;
  float value;
};

/// Returns the mean of the opposite neighbours of (x, y) that both exist, or NaN if there are too few pairs.
float mean_of_opposite(const LumaLevel& level, int x, int y) {
  constexpr int step[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  float sum = 0;
  int pairs = 0;
  for (const auto& [dx, dy] : step) {
    const float pair = level.row(y + dy)[x + dx] + level.row(y - dy)[x - dx];
    if (std::isnan(pair)) continue;
    sum += pair;
    ++pairs;
  }
  return pairs < min_pairs ? missing : sum / static_cast<float>(2 * pairs);
}

/// Fills single missing cells. Values are found for all before any is stored, so that none depends on another.
void fill_single_cells(LumaLevel& level, const std::vector<char>& is_complete, Executor& executor) {
  const int tasks = (level.height() + rows_of_a_task - 1) / rows_of_a_task;
  std::vector<std::vector<Fill>> fills(static_cast<std::size_t>(tasks));
  for_each_index(executor, tasks, [&](int task) {
    const int last = std::min(level.height(), (task + 1) * rows_of_a_task);
    for (int y = task * rows_of_a_task; y < last; ++y) {
      if (is_complete[static_cast<std::size_t>(y)]) continue;
      const float* const row = level.row(y);
      for (int x = 0; x < level.width(); ++x) {
        if (!std::isnan(row[x])) continue;
        const float value = mean_of_opposite(level, x, y);
        if (!std::isnan(value)) fills[static_cast<std::size_t>(task)].push_back({x, y, value});
      }
    }
  });
  for (const auto& of_task : fills) {
    for (const Fill& fill : of_task) level.row(fill.y)[fill.x] = fill.value;
  }
}

LumaLevel cells_of(const FrameView& frame, Executor& executor) {
  const PlaneView<const float>& mosaic = frame.signal_e;
  LumaLevel level(mosaic.width / 2, mosaic.height / 2, 2);
  const bool greens_on_diagonal = colour_at(frame.phase, 0, 0) == CfaColour::green;
  std::vector<char> is_complete(static_cast<std::size_t>(level.height()));
  for_each_band(executor, level.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      is_complete[static_cast<std::size_t>(y)] =
          rows::mean_cells(mosaic.row(2 * y), mosaic.row(2 * y + 1), greens_on_diagonal, level.width(), level.row(y));
    }
  });
  fill_single_cells(level, is_complete, executor);
  return level;
}

LumaLevel halved(const LumaLevel& fine, Executor& executor) {
  LumaLevel level(fine.width() / 2, fine.height() / 2, 2 * fine.cell_px());
  for_each_band(executor, level.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      rows::halve_row(fine.row(2 * y), fine.row(2 * y + 1), level.width(), level.row(y));
    }
  });
  return level;
}

}  // namespace

LumaLevel::LumaLevel(int width, int height, int cell_px)
    : cells_((width + 2 * border + 15) / 16 * 16, height + 2 * border_rows),
      width_(width),
      height_(height),
      cell_px_(cell_px) {
  for (int y = 0; y < cells_.height(); ++y) {
    float* const begin = cells_.row(y);
    const bool is_outside = y < border_rows || y >= border_rows + height;
    if (is_outside) {
      std::fill_n(begin, cells_.width(), missing);
    } else {
      std::fill_n(begin, border, missing);
      std::fill(begin + border + width, begin + cells_.width(), missing);
    }
  }
}

LumaPyramid make_luma_pyramid(const FrameView& frame, Executor& executor) {
  LumaPyramid pyramid;
  for (const double variance : frame.variance_e2) pyramid.variance_e2 += variance / 4;
  if (frame.signal_e.width < 2 || frame.signal_e.height < 2) return pyramid;
  pyramid.levels.push_back(cells_of(frame, executor));
  for (;;) {
    const LumaLevel& last = pyramid.levels.back();
    if (std::max(last.width(), last.height()) <= max_coarsest_side) break;
    if (std::min(last.width(), last.height()) < min_side_to_halve) break;
    pyramid.levels.push_back(halved(last, executor));
  }
  return pyramid;
}

}  // namespace lowlux::merge
