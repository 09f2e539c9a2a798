#include "isp/merge/stars/background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace lowlux::merge {
namespace {

constexpr int tile_px = 8;
constexpr int tiles_of_block = 8;  // each way
constexpr int sites_of_tile = tile_px * tile_px / 4;

/// Means of one tile; NaN if less than half of the sites of any colour have a value.
struct BackgroundTile {
  PerSite<float> mean_e{};
  float mean() const { return (mean_e[0] + mean_e[1] + mean_e[2] + mean_e[3]) / 4; }
};

/// Adds the sites of two rows of a tile.
void add_rows(const float* row, float* sum, std::int32_t* count) {
  for (int x = 0; x < tile_px; ++x) {
    const bool there = row[x] == row[x];
    sum[x] += there ? row[x] : 0.0F;
    count[x] += there ? 1 : 0;
  }
}

BackgroundTile measure_tile(const FrameView& frame, int x, int y) {
  std::array<std::array<float, tile_px>, 2> sum{};
  std::array<std::array<std::int32_t, tile_px>, 2> count{};
  for (int j = 0; j < tile_px; ++j) {
    const auto parity = static_cast<std::size_t>(j & 1);
    add_rows(frame.signal_e.row(y + j) + x, sum[parity].data(), count[parity].data());
  }
  BackgroundTile tile;
  for (std::size_t s = 0; s < 4; ++s) {
    float total = 0;
    std::int32_t sites = 0;
    for (std::size_t i = s % 2; i < tile_px; i += 2) {
      total += sum[s / 2][i];
      sites += count[s / 2][i];
    }
    tile.mean_e[s] =
        2 * sites < sites_of_tile ? std::numeric_limits<float>::quiet_NaN() : total / static_cast<float>(sites);
  }
  return tile;
}

struct BackgroundBlock {
  bool known = false;
  PerSite<double> level_e{};
  double clutter_e2 = 0;  // variance of the means of tiles in excess of noise
};

double median_of_values(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

BackgroundBlock measure_block(const std::vector<BackgroundTile>& tiles, const PerSite<double>& variance_e2) {
  BackgroundBlock block;
  std::vector<float> values;
  for (const BackgroundTile& tile : tiles) {
    if (!std::isnan(tile.mean())) values.push_back(tile.mean());
  }
  if (values.size() < 4) return block;
  const double centre = median_of_values(values);
  for (float& value : values) value = std::fabs(value - static_cast<float>(centre));
  const double mad_std = 1.4826 * median_of_values(values);
  const double read_e2 = mean_of_sites(variance_e2);
  const double noise_e2 = std::max(std::max(centre, 0.0) + read_e2, min_variance_e2) / (tile_px * tile_px);
  const double limit = 3 * std::max(mad_std, std::sqrt(noise_e2));
  int used = 0;
  for (const BackgroundTile& tile : tiles) {
    if (!(std::fabs(static_cast<double>(tile.mean()) - centre) <= limit)) continue;
    for (std::size_t s = 0; s < 4; ++s) block.level_e[s] += static_cast<double>(tile.mean_e[s]);
    ++used;
  }
  for (double& level : block.level_e) level /= used;
  block.known = true;
  block.clutter_e2 = std::max(0.0, mad_std * mad_std - 2 * noise_e2);
  return block;
}

/// Gives blocks without a background the mean of their neighbours that have one, until all have.
bool fill_unknown(std::vector<BackgroundBlock>& blocks, int columns, int rows) {
  if (std::none_of(blocks.begin(), blocks.end(), [](const BackgroundBlock& b) { return b.known; })) return false;
  for (bool complete = false; !complete;) {
    complete = true;
    const std::vector<BackgroundBlock> before = blocks;
    for (int k = 0; k < columns * rows; ++k) {
      BackgroundBlock& block = blocks[k];
      if (block.known) continue;
      int count = 0;
      for (int n = 0; n < 9; ++n) {
        const int i = k % columns + n % 3 - 1, j = k / columns + n / 3 - 1;
        if (i < 0 || j < 0 || i >= columns || j >= rows || !before[j * columns + i].known) continue;
        for (std::size_t s = 0; s < 4; ++s) block.level_e[s] += before[j * columns + i].level_e[s];
        ++count;
      }
      for (double& level : block.level_e) level /= std::max(count, 1);
      block.known = count > 0;
      complete = complete && block.known;
    }
  }
  return true;
}

/// Returns the first tile of block `index` of `count`.
int first_tile(int tiles, int count, int index) {
  return static_cast<int>(static_cast<std::int64_t>(tiles) * index / count);
}

std::vector<float> centres(int tiles, int count) {
  std::vector<float> out;
  for (int i = 0; i < count; ++i) {
    const int both = first_tile(tiles, count, i) + first_tile(tiles, count, i + 1);
    out.push_back(static_cast<float>(tile_px * both - 1) / 2);
  }
  return out;
}

/// Returns the two nodes next to a coordinate, and the weight of the second; beyond the outer nodes, less than 0 or
/// more than 1.
struct NodesBetween {
  int lower;
  int upper;
  double weight;
};
NodesBetween between(const std::vector<float>& nodes, double at) {
  const int last = static_cast<int>(nodes.size()) - 1;
  if (last == 0) return {0, 0, 0};
  const auto above = std::upper_bound(nodes.begin(), nodes.end(), static_cast<float>(at));
  const int i = std::clamp(static_cast<int>(above - nodes.begin()) - 1, 0, last - 1);
  const auto from = static_cast<double>(nodes[i]);
  return {i, i + 1, (at - from) / (static_cast<double>(nodes[i + 1]) - from)};
}

}  // namespace

std::optional<Background> measure_background(const FrameView& frame, double psf_sigma_px, Executor& executor) {
  const int tile_columns = frame.signal_e.width / tile_px, tile_rows = frame.signal_e.height / tile_px;
  if (tile_columns < 2 || tile_rows < 2) return std::nullopt;
  const auto blocks_of = [](int tiles) { return std::max(1, (tiles + tiles_of_block / 2) / tiles_of_block); };
  const int columns = blocks_of(tile_columns), rows = blocks_of(tile_rows);
  std::vector<BackgroundBlock> blocks(static_cast<std::size_t>(columns) * rows);
  for_each_index(executor, rows, [&](int j) {
    std::vector<BackgroundTile> tiles;
    for (int i = 0; i < columns; ++i) {
      tiles.clear();
      for (int y = first_tile(tile_rows, rows, j); y < first_tile(tile_rows, rows, j + 1); ++y) {
        for (int x = first_tile(tile_columns, columns, i); x < first_tile(tile_columns, columns, i + 1); ++x)
          tiles.push_back(measure_tile(frame, tile_px * x, tile_px * y));
      }
      blocks[static_cast<std::size_t>(j) * columns + i] = measure_block(tiles, frame.variance_e2);
    }
  });
  if (!fill_unknown(blocks, columns, rows)) return std::nullopt;
  Background out{.column_px = centres(tile_columns, columns), .row_px = centres(tile_rows, rows)};
  const double sites_of_star = 4 * std::numbers::pi * psf_sigma_px * psf_sigma_px;  // 1 / sum g^2
  for (const BackgroundBlock& block : blocks) {
    PerSite<float> level{}, per_std{};
    for (std::size_t s = 0; s < 4; ++s) {
      const double noise_e2 = std::max(block.level_e[s], 0.0) + frame.variance_e2[s];
      level[s] = static_cast<float>(block.level_e[s]);
      per_std[s] =
          static_cast<float>(1 / std::sqrt(std::max(noise_e2, min_variance_e2) + sites_of_star * block.clutter_e2));
    }
    out.level_e.push_back(level);
    out.per_std.push_back(per_std);
  }
  return out;
}

PerSite<double> level_at(const Background& background, double x, double y) {
  const NodesBetween i = between(background.column_px, x), j = between(background.row_px, y);
  PerSite<double> out{};
  for (std::size_t s = 0; s < 4; ++s) {
    const auto node = [&](int column, int row) {
      return static_cast<double>(background.level_e[static_cast<std::size_t>(row) * background.columns() + column][s]);
    };
    out[s] = (1 - j.weight) * ((1 - i.weight) * node(i.lower, j.lower) + i.weight * node(i.upper, j.lower)) +
             j.weight * ((1 - i.weight) * node(i.lower, j.upper) + i.weight * node(i.upper, j.upper));
  }
  return out;
}

PerSite<double> median_level(const Background& background) {
  PerSite<double> out{};
  for (std::size_t s = 0; s < 4; ++s) {
    std::vector<float> levels;
    for (const PerSite<float>& level : background.level_e) levels.push_back(level[s]);
    out[s] = median_of_values(levels);
  }
  return out;
}

}  // namespace lowlux::merge
