#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "tests/denoise/frames.h"
#include "tests/support/executors.h"

/// Frames that are no mosaics, and how they are developed for comparisons.
namespace lowlux::isp::pixel_testing {

using denoise_testing::exposed;
using denoise_testing::Scene;

inline constexpr std::array layouts{SensorLayout::linear_rgb, SensorLayout::monochrome};

inline constexpr double black_dn = 1024, dn_per_e = 8, full_e = 8000, read_e = 2;

inline double channel_e(const Scene& scene, int x, int y, int c) { return scene(x, y)[static_cast<std::size_t>(c)]; }

/// A frame of three independent colours or of one, 8 DN/e-, of this scene.
inline RawFrame pixel_frame(SensorLayout layout, const Scene& scene, int width, int height, std::uint64_t seed) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.layout = layout;
  const int samples = planes_of(raw);
  raw.dn = Plane<std::uint16_t>(samples * width, height);
  for (int c = 0; c < samples; ++c) {
    const Scene one = [&](int x, int y) {
      const double e = channel_e(scene, x, y, samples == 1 ? 1 : c);
      return std::array{e, e, e};
    };
    const Plane<float> charge_e = exposed({.read_noise_e = read_e}, one, width, height, 10 * seed + c);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double dn = black_dn + dn_per_e * static_cast<double>(charge_e.at(x, y));
        raw.dn.at(samples * x + c, y) =
            static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, black_dn + dn_per_e * full_e)));
      }
    }
  }
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.black_tag =
      BlackLevel{.samples = samples, .pattern_dn = std::vector<double>(static_cast<std::size_t>(samples), black_dn)};
  raw.white_dn.fill(black_dn + dn_per_e * full_e);
  const double offset = (read_e * read_e + 1 / (12 * dn_per_e * dn_per_e)) / (full_e * full_e);
  frame.noise = NoiseProfile{.scale = {1 / full_e, 1 / full_e, 1 / full_e}, .offset = {offset, offset, offset}};
  if (layout == SensorLayout::monochrome) return frame;
  const Matrix3 xyz_to_srgb{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  frame.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = xyz_to_srgb}};
  frame.colour.as_shot_neutral = Vector3{1, 1, 1};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

inline DevelopOptions options_of(const DenoiseChoice& choice) {
  DevelopOptions options{
      .exposure_ev = 0, .tone = ToneCurve::none, .space = OutputSpace::camera, .samples = SampleType::f32};
  options.find_defects = false;
  options.denoise = choice;
  return options;
}

inline DenoiseChoice at(denoise::Level level) { return {.mode = DenoiseChoice::Mode::level, .level = level}; }

inline Developed developed(const RawFrame& frame, const DenoiseChoice& choice, Executor& executor = test::one_thread) {
  Result<Developed> out = develop(frame, options_of(choice), executor);
  EXPECT_TRUE(out) << out.error().message;
  return *std::move(out);
}

/// Slow waves, an edge, and lines two pixels wide: what a filter that is too strong removes.
inline Scene lines(double mean_e) {
  return [=](int x, int y) {
    const double wave = 1 + 0.4 * std::sin(0.05 * x) * std::cos(0.04 * y);
    const double edge = 3 * x + y > 380 ? 1.6 : 0.5, line = y > 128 && x % 12 < 2 ? 1.5 : 1;
    return std::array{mean_e * edge * wave * line, mean_e * edge * line, mean_e * edge * (2 - wave) * line};
  };
}

}  // namespace lowlux::isp::pixel_testing
