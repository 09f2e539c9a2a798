#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>

#include "denoise/denoiser.h"
#include "tests/denoise/frames.h"

/// Flat frames through the denoiser, and what is left of their noise.
namespace lowlux::denoise_testing {

inline constexpr double no_prior = std::numeric_limits<double>::infinity();

inline Camera camera_over(double dark_e) {
  return {.dark_e = {dark_e, dark_e, dark_e, dark_e}, .read_noise_e = dark_e >= 100 ? 4.0 : 1.5};
}

/// Levels that many megapixels of flats go through: `best`, which takes a second for each, only at night.
inline std::span<const denoise::Level> levels_for_flats() {
  const std::span<const denoise::Level> all(denoise::all_levels);
  return std::getenv("LOWLUX_NIGHTLY") != nullptr ? all : all.first(all.size() - 1);
}

/// A frame with all there is of it.
struct Denoised {
  Plane<float> signal, residual, confidence;
  std::array<Plane<float>, 3> site_variance;

  Denoised(const Plane<float>& raw, const Camera& camera, denoise::DenoiseOptions options) : Denoised(raw, camera) {
    options.white_gain = camera.white_gain;
    InlineExecutor one;
    denoise::Denoiser(raw.width(), raw.height(), 1, options.level)
        .run({raw.view(), camera.phase}, camera.noise(), options, signal.view(),
             {residual.view(),
              confidence.view(),
              {site_variance[0].view(), site_variance[1].view(), site_variance[2].view()}},
             one);
  }

  /// Signal of R, mean G and B in cell (x, y) of an rggb mosaic [e-].
  std::array<double, 3> cell(int x, int y) const {
    const auto at = [&](int i, int j) { return static_cast<double>(signal.at(2 * x + i, 2 * y + j)); };
    return {at(0, 0), (at(1, 0) + at(0, 1)) / 2, at(1, 1)};
  }

 private:
  Denoised(const Plane<float>& raw, const Camera& /*camera*/)
      : signal(raw.width(), raw.height()), residual(half(raw)), confidence(half(raw)) {
    for (auto& plane : site_variance) plane = half(raw);
  }
  static Plane<float> half(const Plane<float>& raw) { return {(raw.width() + 1) / 2, (raw.height() + 1) / 2}; }
};

inline double luma_of(const std::array<double, 3>& cell) { return 0.2 * cell[0] + 0.6 * cell[1] + 0.2 * cell[2]; }

/// Predicted variance over the squared error of luma and of R, G, B, over some cells.
struct Calibration {
  std::array<double, 4> predicted{}, squared{};  // luma, R, G, B
  double count = 0;

  void add(const Denoised& out, int x, int y, const std::array<double, 3>& truth) {
    const auto got = out.cell(x, y);
    predicted[0] += static_cast<double>(out.residual.at(x, y));
    squared[0] += std::pow(luma_of(got) - luma_of(truth), 2);
    for (int k = 0; k < 3; ++k) {
      predicted[k + 1] += static_cast<double>(out.site_variance[k].at(x, y));
      const double site = k == 1 ? static_cast<double>(out.signal.at(2 * x + 1, 2 * y)) : got[k];
      squared[k + 1] += std::pow(site - truth[k], 2);
    }
    ++count;
  }
  /// Predicted standard deviation over the root mean square error; 0 is luma.
  double ratio(int i) const { return std::sqrt(predicted[i] / squared[i]); }
};

}  // namespace lowlux::denoise_testing
