#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/random/random.h"
#include "isp/merge/frame.h"

/// Scenes of known truth, and frames of them, for the tests of merging.
namespace lowlux::test {

/// Draws a frame of a mean mosaic: Poisson counts of mean + dark, normal read noise, without the dark mean.
inline Plane<float> noisy_frame(const Plane<float>& mean_e, double dark_e, double read_noise_e, std::uint64_t seed,
                                std::uint32_t frame) {
  Plane<float> out(mean_e.width(), mean_e.height());
  std::vector<float> charge(static_cast<std::size_t>(mean_e.width())), noise(charge.size());
  for (int y = 0; y < mean_e.height(); ++y) {
    for (int x = 0; x < mean_e.width(); ++x) charge[x] = mean_e.at(x, y) + static_cast<float>(dark_e);
    poisson_row({.seed = seed, .frame = frame}, 0, static_cast<std::uint32_t>(y), charge, charge);
    normal_row({.seed = seed, .frame = frame, .purpose = 1}, 0, static_cast<std::uint32_t>(y), 1, noise);
    for (int x = 0; x < mean_e.width(); ++x) {
      out.at(x, y) = charge[x] - static_cast<float>(dark_e) + static_cast<float>(read_noise_e) * noise[x];
    }
  }
  return out;
}

inline Plane<float> flat_mosaic(int width, int height, float value) {
  Plane<float> out(width, height);
  for (float* v = out.data(); v != out.data() + out.size(); ++v) *v = value;
  return out;
}

/// Returns the variance per site without light of noisy_frame.
inline PerSite<double> dark_variance_e2(double dark_e, double read_noise_e) {
  const double v = dark_e + read_noise_e * read_noise_e;
  return {v, v, v, v};
}

/// Returns the signal of a smooth scene at any point: sinusoids down to a period of 6 pixels, with a colour for each
/// channel, between 0.2 and 1.8 times the level.
inline double smooth_scene(double x, double y, int colour, double level) {
  constexpr double tau = 2 * std::numbers::pi;
  const double phase = 1.1 * colour;
  const double detail = 0.25 * std::sin(tau * x / 6.3 + phase) * std::sin(tau * y / 7.1) +
                        0.25 * std::sin(tau * (x + 0.7 * y) / 17 + 1) +
                        0.3 * std::sin(tau * (0.4 * x - y) / 61 + phase);
  return level * (1 + detail);
}

}  // namespace lowlux::test
