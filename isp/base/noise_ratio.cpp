#include "isp/base/noise_ratio.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <vector>

namespace lowlux {
namespace {

/// The blocks along one direction: the first and the last have no end.
struct Axis {
  int blocks;
  int block_px;

  int block_of(int px) const { return px < 0 ? 0 : std::min(px / block_px, blocks - 1); }
  /// Returns the first pixel beyond a block, at most `limit`.
  int end_of(int block, int limit) const {
    return block + 1 >= blocks ? limit : std::min((block + 1) * block_px, limit);
  }
};

}  // namespace

float NoiseRatioView::at(int x, int y) const {
  if (is_one()) return 1;
  return ratio.at(Axis{ratio.width, block_px}.block_of(x_px + x), Axis{ratio.height, block_px}.block_of(y_px + y));
}

void NoiseRatioView::row(int first, int step, int y, std::span<float> out) const {
  assert(step > 0);
  if (is_one()) return std::fill(out.begin(), out.end(), 1.0f);
  const Axis across{ratio.width, block_px};
  const float* const blocks = ratio.row(Axis{ratio.height, block_px}.block_of(y_px + y));
  int px = x_px + first, block = across.block_of(px);
  const int limit = px + static_cast<int>(out.size()) * step;
  int end = across.end_of(block, limit);
  for (float& to : out) {
    while (px >= end) end = across.end_of(++block, limit);
    to = blocks[block];
    px += step;
  }
}

float NoiseRatioView::largest() const {
  if (is_one()) return 1;
  float out = 0;
  for (int y = 0; y < ratio.height; ++y)
    out = std::max(out, *std::max_element(ratio.row(y), ratio.row(y) + ratio.width));
  return out;
}

double NoiseRatioView::mean(int x, int y, int width, int height) const {
  assert(width > 0 && height > 0);
  if (is_one()) return 1;
  const Axis across{ratio.width, block_px}, down{ratio.height, block_px};
  const int right = x_px + x + width, bottom = y_px + y + height;
  double sum = 0;
  for (int top = y_px + y, to_y = 0; top < bottom; top = to_y) {
    const int row = down.block_of(top);
    to_y = down.end_of(row, bottom);
    for (int left = x_px + x, to_x = 0; left < right; left = to_x) {
      const int column = across.block_of(left);
      to_x = across.end_of(column, right);
      sum += static_cast<double>(to_x - left) * (to_y - top) * static_cast<double>(ratio.at(column, row));
    }
  }
  return sum / (static_cast<double>(width) * height);
}

NoiseRatioView view_of(const NoiseRatio* ratio) {
  if (ratio == nullptr) return {};
  assert(ratio->block_px > 0 && !ratio->ratio.empty());
  return {ratio->ratio.view(), ratio->block_px, 0, 0};
}

double median_ratio(const NoiseRatio* ratio) {
  if (ratio == nullptr) return 1;
  std::vector<float> all(ratio->ratio.data(), ratio->ratio.data() + ratio->ratio.size());
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return static_cast<double>(*middle);
}

}  // namespace lowlux
