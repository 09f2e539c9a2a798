#include "isp/render/block_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lowlux::isp {

std::vector<float> block_luminance(const RgbView<const float>& blocks, const Vector3& weights) {
  std::vector<float> luminance;
  luminance.reserve(static_cast<std::size_t>(blocks[0].width) * blocks[0].height);
  for (int y = 0; y < blocks[0].height; ++y) {
    const float *r = blocks[0].row(y), *g = blocks[1].row(y), *b = blocks[2].row(y);
    for (int x = 0; x < blocks[0].width; ++x) {
      luminance.push_back(static_cast<float>(weights[0] * r[x] + weights[1] * g[x] + weights[2] * b[x]));
    }
  }
  return luminance;
}

std::optional<double> quantile(std::span<const float> values, double share) {
  std::vector<float> copy(values.begin(), values.end());
  return quantile_reordering(copy, share);
}

std::optional<double> quantile_reordering(std::span<float> values, double share) {
  const auto end = std::partition(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
  const auto finite = end - values.begin();
  if (finite == 0) return std::nullopt;
  const auto rank = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(finite - 1));
  std::nth_element(values.begin(), rank, end);
  return *rank;
}

double black_scatter(std::span<const float> values) { return std::fmax(0, -quantile(values, 0.01).value_or(0)); }

double black_scatter_reordering(std::span<float> values) {
  return std::fmax(0, -quantile_reordering(values, 0.01).value_or(0));
}

}  // namespace lowlux::isp
