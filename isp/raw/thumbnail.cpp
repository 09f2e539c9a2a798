#include "isp/raw/thumbnail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr int max_blocks = 256;  // in either direction
constexpr double difference_to_std =
    0.886226925452758;  // sqrt(pi) / 2: mean |a - b| of two normals is 2 std / sqrt(pi)

// Sums of one block, per colour sample: site of a Bayer cell, or R, G, B of linear_rgb.
struct BlockSums {
  std::array<std::int64_t, 4> sum{};
  std::array<std::int64_t, 4> n{};
  std::int64_t clipped = 0;
  std::int64_t difference = 0;
  std::int64_t differences = 0;
};

struct Layout {
  int block = 2;    // side in pixels, even
  int samples = 1;  // per pixel
  int columns = 0;
  int rows = 0;
};

Layout layout_of(const RawDn& raw) {
  Layout l;
  const int side = std::max(raw.active.width, raw.active.height);
  l.block = std::max(4, (side + max_blocks - 1) / max_blocks);
  l.block += l.block & 1;
  l.samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  l.columns = (raw.active.width + l.block - 1) / l.block;
  l.rows = (raw.active.height + l.block - 1) / l.block;
  return l;
}

// One row of one block: sums of the even and of the odd columns.
void add_row(const std::uint16_t* dn, int width, int y, std::uint16_t white, BlockSums& block) {
  std::uint32_t even = 0, odd = 0, clipped = 0, difference = 0;
  for (int x = 0; x + 1 < width; x += 2) {
    even += dn[x];
    odd += dn[x + 1];
    clipped += (dn[x] >= white) + (dn[x + 1] >= white);
  }
  if (width & 1) {
    even += dn[width - 1];
    clipped += dn[width - 1] >= white;
  }
  for (int x = 0; x + 3 < width; x += 4) difference += static_cast<std::uint32_t>(std::abs(dn[x] - dn[x + 2]));
  const int left = site_of(0, y);
  block.sum[left] += even;
  block.sum[left + 1] += odd;
  block.n[left] += (width + 1) / 2;
  block.n[left + 1] += width / 2;
  block.clipped += clipped;
  block.difference += difference;
  block.differences += width / 4;
}

void add_rgb_row(const std::uint16_t* dn, int width, const std::array<double, 3>& white, BlockSums& block) {
  for (int x = 0; x < width; ++x) {
    if (x + 1 < width) block.difference += std::abs(dn[3 * x + 1] - dn[3 * x + 4]);
    for (int c = 0; c < 3; ++c) {
      block.sum[c] += dn[3 * x + c];
      block.clipped += dn[3 * x + c] >= white[c];
    }
  }
  block.differences += width - 1;
  for (int c = 0; c < 3; ++c) block.n[c] += width;
}

// Fraction of white of each colour, mean over the block.
std::array<double, 3> colour_means(const RawDn& raw, const BlackPoint& black, const BlockSums& block) {
  std::array<double, 3> sum{};
  std::array<int, 3> n{};
  for (int i = 0; i < 4; ++i) {
    if (block.n[i] == 0) continue;
    const double mean = static_cast<double>(block.sum[i]) / static_cast<double>(block.n[i]);
    const double fraction = (mean - black.pedestal_dn[i]) / (white_at(raw, i) - black.pedestal_dn[i]);
    const auto add = [&](int c) {
      sum[c] += fraction;
      ++n[c];
    };
    switch (raw.layout) {
      case SensorLayout::bayer:
        add(static_cast<int>(colour_at(raw.phase, i & 1, i >> 1)));
        break;
      case SensorLayout::linear_rgb:
        add(std::min(i, 2));
        break;
      case SensorLayout::monochrome:
        add(0), add(1), add(2);
        break;
    }
  }
  for (int c = 0; c < 3; ++c) sum[c] = n[c] > 0 ? sum[c] / n[c] : 0.0;
  return sum;
}

double black_noise(const RawFrame& frame, const BlackPoint& black, std::vector<double> block_differences_dn) {
  const double range = mean_range_dn(frame.raw, black);
  const double measured = *std::max_element(black.noise_std_dn.begin(), black.noise_std_dn.end());
  if (measured > 0) return measured / range;
  if (frame.noise && frame.noise->offset[1] > 0) return std::sqrt(frame.noise->offset[1]);
  if (block_differences_dn.empty()) return 0;
  const auto low = block_differences_dn.begin() + static_cast<std::ptrdiff_t>(block_differences_dn.size() / 20);
  std::nth_element(block_differences_dn.begin(), low, block_differences_dn.end());
  return difference_to_std * *low / range;
}

void sum_block_row(const RawDn& raw, const Layout& l, int block_row, BlockSums* blocks) {
  const Rect& a = raw.active;
  const auto white =
      static_cast<std::uint16_t>(std::min(65535.0, *std::min_element(raw.white_dn.begin(), raw.white_dn.end())));
  const int y_end = std::min((block_row + 1) * l.block, a.height);
  for (int y = block_row * l.block; y < y_end; ++y) {
    const std::uint16_t* row = raw.dn.row(a.y + y) + a.x * l.samples;
    for (int b = 0; b < l.columns; ++b) {
      const int x = b * l.block;
      const int width = std::min(l.block, a.width - x);
      if (l.samples == 3) {
        add_rgb_row(row + 3 * x, width, raw.white_dn, blocks[b]);
      } else {
        add_row(row + x, width, y, white, blocks[b]);
      }
    }
  }
}

}  // namespace

Thumbnail make_thumbnail(const RawFrame& frame, const BlackPoint& black, Executor& executor) {
  const RawDn& raw = frame.raw;
  const Layout l = layout_of(raw);
  std::vector<BlockSums> blocks(static_cast<std::size_t>(l.columns) * l.rows);
  for_each_band(executor, l.rows, [&](RowBand band, int) {
    for (int r = band.first; r < band.last; ++r)
      sum_block_row(raw, l, r, &blocks[static_cast<std::size_t>(r) * l.columns]);
  });

  Thumbnail out{CameraRgb(l.columns, l.rows), 0};
  std::vector<double> differences;
  for (int y = 0; y < l.rows; ++y) {
    for (int x = 0; x < l.columns; ++x) {
      const BlockSums& block = blocks[static_cast<std::size_t>(y) * l.columns + x];
      const std::array<double, 3> mean = colour_means(raw, black, block);
      for (int c = 0; c < 3; ++c) out.mean.plane[c].at(x, y) = static_cast<float>(mean[c]);
      if (block.difference > 0 && block.clipped == 0)
        differences.push_back(static_cast<double>(block.difference) / static_cast<double>(block.differences));
    }
  }
  out.black_noise_std = black_noise(frame, black, std::move(differences));
  return out;
}

}  // namespace lowlux::isp
