#include "denoise/spatial/chroma_start.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lowlux::denoise {
namespace {

struct Place {
  int first;
  int second;
  float fraction;
};

/// Returns the tiles around the centre of cell i of level `grid`, with the fraction between their centres.
Place place_of(int i, int grid, int tiles) {
  const float at = (static_cast<float>(i) + 0.5f) * static_cast<float>(1 << grid) / tile - 0.5f;
  const float inside = std::clamp(at, 0.0f, static_cast<float>(tiles - 1));
  const int first = static_cast<int>(inside);
  return {first, std::min(first + 1, tiles - 1), inside - static_cast<float>(first)};
}

/// Returns the first cell of level `grid` at or beyond the centre of a tile.
int next_centre(int column, int grid) {
  const int cells = tile >> grid;  // cells of a tile: a power of two
  return column * cells + cells / 2;
}

}  // namespace

int start_of(double mean_signal_e, double mean_dark_e, double variance_e2, double noise_ratio) {
  if (!(mean_signal_e > 0)) return 2;
  const double q = mean_signal_e / std::sqrt(noise_ratio * (mean_signal_e + mean_dark_e + variance_e2));
  return q >= 3 ? 0 : q >= 0.7 ? 1 : 2;
}

void complete(ChromaStarts& starts) {
  starts.least = *std::min_element(starts.start.begin(), starts.start.end());
  starts.most = *std::max_element(starts.start.begin(), starts.start.end());
  const auto tiles = static_cast<std::size_t>(starts.columns) * static_cast<std::size_t>(starts.rows);
  for (int level = 0; level < max_levels; ++level) {
    for (int y = 0; y < starts.rows; ++y) {
      for (int x = 0; x < starts.columns; ++x) {
        float least = 2;
        for (int j = std::max(0, y - 2); j <= std::min(starts.rows - 1, y + 2); ++j) {
          for (int i = std::max(0, x - 2); i <= std::min(starts.columns - 1, x + 2); ++i) {
            least = std::min(least, starts.start[j * starts.columns + i]);
          }
        }
        starts.has_chroma[level * tiles + y * starts.columns + x] = least <= static_cast<float>(level) ? 1 : 0;
      }
    }
  }
}

void interpolate_row(std::span<const float> tiles, int columns, int rows, int grid, int y, std::span<float> out) {
  const Place v = place_of(y, grid, rows);
  const float* const upper = tiles.data() + v.first * columns;
  const float* const lower = tiles.data() + v.second * columns;
  const auto value = [&](int i) { return upper[i] + v.fraction * (lower[i] - upper[i]); };
  const int width = static_cast<int>(out.size());
  // Between the centres of two tiles everything is linear: process one run of cells after the other.
  for (int x = 0; x < width;) {
    const Place u = place_of(x, grid, columns);
    const int end = u.second == u.first ? width : std::min(width, next_centre(u.first + 1, grid));
    const float left = value(u.first), step = value(u.second) - left;
    const float cell = static_cast<float>(1 << grid) / tile, origin = static_cast<float>(u.first);
    for (; x < end; ++x) {
      const float at = (static_cast<float>(x) + 0.5f) * cell - 0.5f;
      const float fraction = u.second == u.first ? 0.0f : std::max(at, 0.0f) - origin;
      out[x] = left + fraction * step;
    }
  }
}

void fraction_row(const ChromaStarts& starts, int level, int grid, int y, std::span<float> out) {
  interpolate_row(starts.start, starts.columns, starts.rows, grid, y, out);
  for (float& start : out) start = std::clamp(start - static_cast<float>(level), 0.0f, 1.0f);
}

}  // namespace lowlux::denoise
