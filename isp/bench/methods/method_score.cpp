#include "isp/bench/methods/method_score.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isp/base/plane.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Returns the sum of the channels, weighted to luminance; of codes the luma.
Plane<float> weighted(const SceneLinear& image) {
  const Vector3 weights = luminance_weights(OutputSpace::linear_srgb).value();  // weights of a space with primaries
  Plane<float> out(image.width(), image.height());
  for (std::size_t i = 0; i < out.size(); ++i) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += weights[c] * static_cast<double>(image.plane[c].data()[i]);
    out.data()[i] = static_cast<float>(sum);
  }
  return out;
}

double box_sum(const Plane<float>& plane, int x0, int y0, int reach) {
  double sum = 0;
  for (int y = y0 - reach; y <= y0 + reach; ++y) {
    for (int x = x0 - reach; x <= x0 + reach; ++x) sum += static_cast<double>(plane.at(x, y));
  }
  return sum;
}

double detail_at(const Plane<float>& luma, int x, int y) {
  constexpr int reach = 2;
  return static_cast<double>(luma.at(x, y)) - box_sum(luma, x, y, reach) / ((2 * reach + 1) * (2 * reach + 1));
}

constexpr int star_reach = 2, ring_inner = 4, ring_outer = 6;

/// Returns the light of a star above that of the ring around it.
double star_light(const Plane<float>& luminance, int x0, int y0) {
  double ring = 0;
  int pixels = 0;
  for (int y = -ring_outer; y <= ring_outer; ++y) {
    for (int x = -ring_outer; x <= ring_outer; ++x) {
      const int r2 = x * x + y * y;
      if (r2 < ring_inner * ring_inner || r2 > ring_outer * ring_outer) continue;
      ring += static_cast<double>(luminance.at(x0 + x, y0 + y));
      ++pixels;
    }
  }
  constexpr int side = 2 * star_reach + 1;
  return box_sum(luminance, x0, y0, star_reach) - side * side * ring / pixels;
}

double chroma_bias_of(const SceneLinear& lab, const SceneLinear& truth) {
  double squares = 0;
  for (std::size_t c = 1; c < 3; ++c) {
    double sum = 0;
    for (std::size_t i = 0; i < lab.plane[c].size(); ++i) {
      sum += static_cast<double>(lab.plane[c].data()[i]) - static_cast<double>(truth.plane[c].data()[i]);
    }
    squares += std::pow(sum / static_cast<double>(lab.plane[c].size()), 2);
  }
  return std::sqrt(squares);
}

}  // namespace

double texture_kept(const SceneLinear& codes, const SceneLinear& truth) {
  constexpr int border = 2;
  const Plane<float> luma = weighted(codes), true_luma = weighted(truth);
  double product = 0, square = 0;
  for (int y = border; y < luma.height() - border; ++y) {
    for (int x = border; x < luma.width() - border; ++x) {
      const double expected = detail_at(true_luma, x, y);
      product += detail_at(luma, x, y) * expected;
      square += expected * expected;
    }
  }
  return square > 0 ? product / square : nan;
}

double stars_kept(const SceneLinear& light, const SceneLinear& truth, std::span<const StarPlace> stars) {
  const Plane<float> luminance = weighted(light), true_luminance = weighted(truth);
  double found = 0, expected = 0;
  for (const StarPlace& star : stars) {
    const int x = static_cast<int>(std::lround(star.x_px)), y = static_cast<int>(std::lround(star.y_px));
    if (std::min({x, y, truth.width() - 1 - x, truth.height() - 1 - y}) < ring_outer) continue;
    found += star_light(luminance, x, y);
    expected += star_light(true_luminance, x, y);
  }
  return expected > 0 ? found / expected : nan;
}

MethodScore score_of(const RenderedPicture& picture, const PictureTruth& truth, const MethodScene& scene,
                     Executor& executor) {
  const PictureTruth as_seen(picture.display.view(), executor);
  return {.error = picture_error(picture, truth, executor),
          .chroma_bias = chroma_bias_of(as_seen.lab(), truth.lab()),
          .texture_kept = texture_kept(as_seen.encoded(), truth.encoded()),
          .stars_kept = stars_kept(picture.light, scene.picture.linear, scene.stars)};
}

}  // namespace lowlux::isp
