#include "isp/render/block_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

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

std::vector<float> block_values(const PlaneView<const float>& plane) {
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(plane.width) * plane.height);
  for (int y = 0; y < plane.height; ++y) values.insert(values.end(), plane.row(y), plane.row(y) + plane.width);
  return values;
}

std::optional<double> quantile(std::span<const float> values, double share) {
  std::vector<float> finite;
  finite.reserve(values.size());
  std::copy_if(values.begin(), values.end(), std::back_inserter(finite), [](float v) { return std::isfinite(v); });
  if (finite.empty()) return std::nullopt;
  const auto rank = finite.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
  std::nth_element(finite.begin(), rank, finite.end());
  return *rank;
}

double black_scatter(std::span<const float> values) { return std::fmax(0, -quantile(values, 0.01).value_or(0)); }

}  // namespace lowlux::isp
