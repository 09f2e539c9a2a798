#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "denoise/denoiser.h"
#include "tests/denoise/frames.h"
#include "tests/reference/denoise_ref.h"

/// The denoiser against the same method in plain double.
namespace lowlux::denoise_testing {

inline double scale_of(const Plane<float>& raw) {
  double most = 1;
  for (std::size_t i = 0; i < raw.size(); ++i) most = std::max(most, std::abs(static_cast<double>(raw.data()[i])));
  return most;
}

/// Expects values within `tolerance` and `relative` of themselves.
inline void expect_near(PlaneView<const float> got, PlaneView<const double> expected, double tolerance, double relative,
                        const std::string& what) {
  double worst = 0;
  int at_x = 0, at_y = 0;
  for (int y = 0; y < got.height; ++y) {
    for (int x = 0; x < got.width; ++x) {
      const double value = expected.at(x, y);
      const double excess = std::abs(static_cast<double>(got.at(x, y)) - value) - relative * std::abs(value);
      if (!(excess <= worst)) {
        worst = excess;
        at_x = x;
        at_y = y;
      }
    }
  }
  EXPECT_LE(worst, tolerance) << what << " at " << at_x << ", " << at_y << ", " << expected.at(at_x, at_y);
}

// A sample passes through some 600 float operations in two passes and five levels, each with a relative error of at
// most 2^-24 of the largest value there is. They add up like a random walk, sqrt(600) 2^-24 = 1.5e-6; three times that
// for the worst of 1e5 samples. Confidence is the ratio of squares of luma, whose relative error is larger where it is
// dark. Variances can be many times the signal, next to lamps of a bracket: what they are sums of is rounded to 2^-24
// of itself, of which eight roundings are added.
inline void compare(const Camera& camera, const denoise::RawNoise& noise, const Plane<float>& raw,
                    const denoise::DenoiseOptions& options, const NoiseRatioView& ratio = {}) {
  const int columns = (raw.width() + 1) / 2, rows = (raw.height() + 1) / 2;
  Plane<float> signal(raw.width(), raw.height()), residual(columns, rows), confidence(columns, rows);
  InlineExecutor one;
  denoise::Denoiser denoiser(raw.width(), raw.height(), 1, options.level);
  std::array<Plane<float>, 3> site;
  for (auto& plane : site) plane = Plane<float>(columns, rows);
  denoiser.run({raw.view(), camera.phase, ratio}, noise, options, signal.view(),
               {residual.view(), confidence.view(), {site[0].view(), site[1].view(), site[2].view()}}, one);
  const auto expected = reference::denoise({raw.view(), camera.phase, ratio}, noise, options);
  const double scale = scale_of(raw) * *std::max_element(options.white_gain.begin(), options.white_gain.end());
  expect_near(signal.view(), expected.signal_e.view(), 5e-6 * scale, 0, "signal");
  expect_near(residual.view(), expected.residual_variance.view(), 5e-6 * scale, 0x1p-21, "residual");
  expect_near(confidence.view(), expected.chroma_confidence.view(), 1e-4, 0, "confidence");
  for (int k = 0; k < 3; ++k) {
    expect_near(site[k].view(), expected.site_variance[k].view(), 5e-6 * scale, 0x1p-21,
                "variance of " + std::to_string(k));
  }
}

inline void compare(const Camera& camera, const Plane<float>& raw, const denoise::DenoiseOptions& options) {
  compare(camera, camera.noise(), raw, options);
}

}  // namespace lowlux::denoise_testing
