#include "isp/pipeline/render/level_parts.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "isp/pipeline/render/frame_tiles.h"

namespace lowlux::isp {
namespace {

constexpr int noise_block = 8;  // cells, each way

/// Holds a range of regions of a grid, ends excluded.
struct Cells {
  int left, top, right, bottom;
};

Cells cells_of(const NoiseRegions& regions, const Rect& core) {
  return {core.x / regions.size, core.y / regions.size, (core.x + core.width - 1) / regions.size + 1,
          (core.y + core.height - 1) / regions.size + 1};
}

Rect rect_of(const NoiseRegions& regions, const Cells& cells) {
  return {cells.left * regions.size, cells.top * regions.size, (cells.right - cells.left) * regions.size,
          (cells.bottom - cells.top) * regions.size};
}

std::optional<denoise::Level> level_at(const NoiseRegions& regions, int column, int row) {
  return regions.level[static_cast<std::size_t>(row) * regions.columns + column];
}

bool all_have(const NoiseRegions& regions, const Cells& cells, std::optional<denoise::Level> level) {
  for (int row = cells.top; row < cells.bottom; ++row) {
    for (int column = cells.left; column < cells.right; ++column) {
      if (level_at(regions, column, row) != level) return false;
    }
  }
  return true;
}

bool touches(const Rect& a, const Rect& b) {
  const Rect both = overlap(a, b);
  return both.width > 0 && both.height > 0;
}

/// Returns the largest tile that starts at a region: extended first to the right, then downwards.
Cells joined(const NoiseRegions& regions, int column, int row, const Cells& within, int side,
             const std::vector<LevelPart>& taken) {
  const auto level = level_at(regions, column, row);
  const int most = std::max(side / regions.size, 1);
  const auto free = [&](const Cells& cells) {
    return all_have(regions, cells, level) && std::ranges::none_of(taken, [&](const LevelPart& part) {
             return touches(part.core, rect_of(regions, cells));
           });
  };
  Cells out{column, row, column + 1, row + 1};
  while (out.right < std::min(within.right, column + most) && free({out.right, row, out.right + 1, row + 1})) {
    ++out.right;
  }
  while (out.bottom < std::min(within.bottom, row + most) && free({column, out.bottom, out.right, out.bottom + 1})) {
    ++out.bottom;
  }
  return out;
}

/// Holds sums and counts of the finite values of each colour in a block of sites, for their means.
struct BlockMeans {
  std::array<double, 3> sum{};
  std::array<int, 3> count{};
};

BlockMeans sums_of(const denoise::RawElectronsView& raw_e, const Rect& sites) {
  BlockMeans out;
  for (int y = sites.y; y < sites.y + sites.height; ++y) {
    for (int x = sites.x; x < sites.x + sites.width; ++x) {
      const float e = raw_e.value.at(x, y);
      if (!std::isfinite(e)) continue;
      const auto colour = static_cast<std::size_t>(colour_at(raw_e.phase, x, y));
      out.sum[colour] += e;
      ++out.count[colour];
    }
  }
  return out;
}

void fill(const PlaneView<float>& map, const Rect& cells, double value) {
  for (int y = cells.y; y < cells.y + cells.height; ++y) {
    std::fill_n(map.row(y) + cells.x, cells.width, static_cast<float>(value));
  }
}

}  // namespace

void split_by_level(const NoiseReduction& how, const Rect& core, int side, std::vector<LevelPart>& parts) {
  parts.clear();
  if (!how.regions) return parts.push_back({core, how.level});
  const NoiseRegions& regions = *how.regions;
  assert(regions.size > 0 && regions.size % tile_lattice_px == 0);
  const Cells within = cells_of(regions, core);
  assert(within.right <= regions.columns && within.bottom <= regions.rows);
  assert(regions.level.size() == static_cast<std::size_t>(regions.columns) * regions.rows);
  const auto first = level_at(regions, within.left, within.top);
  if (all_have(regions, within, first)) return parts.push_back({core, first});
  for (int row = within.top; row < within.bottom; ++row) {
    for (int column = within.left; column < within.right; ++column) {
      const Rect own = overlap(rect_of(regions, {column, row, column + 1, row + 1}), core);
      if (std::ranges::any_of(parts, [&](const LevelPart& part) { return touches(part.core, own); })) continue;
      const Cells cells = joined(regions, column, row, within, side, parts);
      parts.push_back({overlap(rect_of(regions, cells), core), level_at(regions, column, row)});
    }
  }
}

denoise::Level max_level_of(const NoiseReduction& how) {
  if (!how.regions) return *how.level;
  denoise::Level most = denoise::Level::draft;
  for (const auto& level : how.regions->level) most = std::max(most, level.value_or(denoise::Level::draft));
  return most;
}

void subtract_dark_charge(PlaneView<const float> raw_e, const denoise::RawNoise& noise, PlaneView<float> signal_e,
                          Executor& executor) {
  for_each_band(executor, raw_e.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const int left = site_of(0, y);
      const auto even = static_cast<float>(noise.dark_mean_e[left]);
      const auto odd = static_cast<float>(noise.dark_mean_e[left + 1]);
      const float* const in = raw_e.row(y);
      float* const out = signal_e.row(y);
      for (int x = 0; x < raw_e.width; ++x) out[x] = in[x] - ((x & 1) != 0 ? odd : even);
    }
  });
}

void set_own_noise(const denoise::RawElectronsView& raw_e, const NoiseReduction& how,
                   const denoise::DenoiseMaps& maps) {
  const int columns = maps.residual_variance.width, rows = maps.residual_variance.height;
  for (int y = 0; y < rows; y += noise_block) {
    for (int x = 0; x < columns; x += noise_block) {
      const Rect cells{x, y, std::min(noise_block, columns - x), std::min(noise_block, rows - y)};
      const Rect sites{2 * x, 2 * y, 2 * cells.width, 2 * cells.height};
      const BlockMeans means = sums_of(raw_e, overlap(sites, {0, 0, raw_e.value.width, raw_e.value.height}));
      const double ratio = raw_e.noise_ratio.mean(sites.x, sites.y, sites.width, sites.height);
      double luma_e2 = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double mean_e = means.count[c] > 0 ? means.sum[c] / means.count[c] : 0;
        const double variance_e2 =
            ratio * how.options.variance_scale[0] * (std::max(mean_e, 0.0) + how.noise.variance_e2[c]);
        luma_e2 +=
            (c == 1 ? 2 * 0.3 * 0.3 : 0.2 * 0.2) * how.options.white_gain[c] * how.options.white_gain[c] * variance_e2;
        fill(maps.site_variance[c], cells, variance_e2);
      }
      fill(maps.residual_variance, cells, luma_e2);
      fill(maps.chroma_confidence, cells, 1);
    }
  }
}

}  // namespace lowlux::isp
