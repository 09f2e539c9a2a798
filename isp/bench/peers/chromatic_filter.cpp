#include "isp/bench/peers/chromatic_filter.h"

#include <algorithm>
#include <cassert>
#include <vector>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

/// Returns means of 2 radius + 1 samples along each row, those inside the image, transposed: rows become columns.
Plane<float> row_means(const PlaneView<const float>& in, int radius) {
  Plane<float> out(in.height, in.width);
  std::vector<double> sum(static_cast<std::size_t>(in.width) + 1, 0.0);  // sums of all preceding samples
  for (int y = 0; y < in.height; ++y) {
    const float* const row = in.row(y);
    for (int x = 0; x < in.width; ++x) sum[x + 1] = sum[x] + static_cast<double>(row[x]);
    for (int x = 0; x < in.width; ++x) {
      const int first = std::max(x - radius, 0), last = std::min(x + radius + 1, in.width);
      out.at(y, x) = static_cast<float>((sum[last] - sum[first]) / (last - first));
    }
  }
  return out;
}

Plane<float> box_means(const PlaneView<const float>& in, int radius) {
  return row_means(row_means(in, radius).view(), radius);
}

}  // namespace

SceneLinear chromatic_filtered(const RgbView<const float>& linear, const ChromaticWindows& windows) {
  assert(windows.chroma_radius >= 0 && windows.luminance_radius >= 0);
  const Vector3 weights = luminance_weights(OutputSpace::linear_srgb).value();  // has primaries
  const int width = linear[0].width, height = linear[0].height;
  SceneLinear out;
  Plane<float> luminance(width, height), window_luminance(width, height);
  for (std::size_t c = 0; c < 3; ++c) out.plane[c] = box_means(linear[c], windows.chroma_radius);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double here = 0, window = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        here += weights[c] * static_cast<double>(linear[c].at(x, y));
        window += weights[c] * static_cast<double>(out.plane[c].at(x, y));
      }
      luminance.at(x, y) = static_cast<float>(here);
      window_luminance.at(x, y) = static_cast<float>(window);
    }
  }
  luminance = box_means(luminance.view(), windows.luminance_radius);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < luminance.size(); ++i) {
      const float window = window_luminance.data()[i];
      float& value = out.plane[c].data()[i];
      value = window > 0 ? value / window * luminance.data()[i] : luminance.data()[i];
    }
  }
  return out;
}

}  // namespace lowlux::isp
