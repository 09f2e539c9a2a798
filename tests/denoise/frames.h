#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/plane.h"
#include "isp/base/random/random.h"

namespace lowlux::denoise_testing {

struct Camera {
  BayerPhase phase = BayerPhase::rggb;
  PerSite<double> dark_e{};
  double read_noise_e = 1.5;
  std::array<double, 3> white_gain{1, 1, 1};

  denoise::RawNoise noise() const {
    const double read_e2 = read_noise_e * read_noise_e;
    return {.dark_mean_e = dark_e, .variance_e2 = {read_e2, read_e2, read_e2}};
  }
};

/// Mean signal [e-] of R, G, B at pixel (x, y).
using Scene = std::function<std::array<double, 3>(int x, int y)>;

inline Scene flat(double red_e, double green_e, double blue_e) {
  return [=](int, int) { return std::array{red_e, green_e, blue_e}; };
}

/// Slow waves and a sharp edge, colours that change.
inline Scene waves(double mean_e) {
  return [mean_e](int x, int y) {
    const double edge = 3 * x + y > 200 ? 1.6 : 0.5, wave = 1 + 0.4 * std::sin(0.11 * x) * std::cos(0.07 * y);
    return std::array{mean_e * edge * wave, mean_e * edge, mean_e * edge * (2 - wave)};
  };
}

inline double mean_e(const Camera& camera, const Scene& scene, int x, int y) {
  const auto colour = static_cast<std::size_t>(colour_at(camera.phase, x, y));
  return scene(x, y)[colour];
}

/// Poisson(signal + dark) + read noise, pedestal off.
inline Plane<float> exposed(const Camera& camera, const Scene& scene, int width, int height, std::uint64_t seed) {
  Plane<float> out(width, height);
  std::vector<float> mean(width), normal(width);
  const DrawStream stream{.seed = seed, .frame = 0, .purpose = draw_purpose::electrons};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      mean[x] = static_cast<float>(mean_e(camera, scene, x, y) + camera.dark_e[site_of(x, y)]);
    }
    poisson_row(stream, 0, y, mean, {out.row(y), static_cast<std::size_t>(width)});
    normal_row(stream, 0, y, 1, normal);
    for (int x = 0; x < width; ++x) out.at(x, y) += static_cast<float>(camera.read_noise_e) * normal[x];
  }
  return out;
}

/// Mean over the sites of each colour.
template <class T>
std::array<double, 3> colour_means(PlaneView<T> mosaic, BayerPhase phase) {
  std::array<double, 3> sum{}, count{};
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(phase, x, y));
      sum[c] += static_cast<double>(mosaic.at(x, y));
      count[c] += 1;
    }
  }
  return {sum[0] / count[0], sum[1] / count[1], sum[2] / count[2]};
}

}  // namespace lowlux::denoise_testing
