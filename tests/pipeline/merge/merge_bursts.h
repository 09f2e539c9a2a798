#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/pipeline/merge/merge_frames.h"
#include "tests/merge/merge_scene.h"
#include "tests/pipeline/night_frames.h"

namespace lowlux::test {

/// Returns whether two frames have the same bytes, codes or floating-point samples.
inline bool same_samples(const RawDn& a, const RawDn& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.width() == y.width() && x.height() == y.height() &&
           (x.empty() || std::memcmp(x.data(), y.data(), sizeof(*x.data()) * x.size()) == 0);
  };
  return same(a.dn, b.dn) && same(a.dn_float, b.dn_float);
}

/// Returns the signal of a scene of structure of many sizes without a period: a sum of sinusoids whose directions and
/// phases are drawn, finest 5 pixels.
inline double textured(double x, double y, int colour, double level) {
  struct Wave {
    double u, v, phase;
  };
  static const std::vector<Wave> waves = [] {
    std::mt19937_64 draw(99);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Wave> out;
    for (int i = 0; i < 12; ++i) {
      const double frequency = 2 * std::numbers::pi / (5 * std::pow(1.4, i)), angle = 2 * std::numbers::pi * unit(draw);
      out.push_back({frequency * std::cos(angle), frequency * std::sin(angle), 2 * std::numbers::pi * unit(draw)});
    }
    return out;
  }();
  double sum = 0;
  for (const Wave& wave : waves) sum += std::sin(wave.u * x + wave.v * y + wave.phase + 0.3 * colour);
  return level * std::max(0.1, 1 + 0.14 * sum);
}

/// Returns the positions of hand-held frames: each is displaced by up to `reach_px` along each axis and turned by up to
/// one degree, drawn from the seed and its index.
inline std::function<std::array<double, 2>(int, double, double)> hand_held_position(int width, int height,
                                                                                    double reach_px,
                                                                                    std::uint64_t seed) {
  constexpr std::uint64_t max_frames = 64;
  struct Motion {
    double dx, dy, cosine, sine;
  };
  std::vector<Motion> motions;
  for (std::uint64_t i = 0; i < max_frames; ++i) {
    std::mt19937_64 draw(seed + i);
    std::uniform_real_distribution<double> unit(-1, 1);
    const double dx = reach_px * unit(draw), dy = reach_px * unit(draw), turn = std::numbers::pi / 180 * unit(draw);
    motions.push_back({dx, dy, std::cos(turn), std::sin(turn)});
  }
  return [=](int index, double x, double y) {
    const Motion& m = motions.at(static_cast<std::size_t>(index));
    const double u = x - width / 2.0 - m.dx, v = y - height / 2.0 - m.dy;
    return std::array{width / 2.0 + u * m.cosine + v * m.sine, height / 2.0 - u * m.sine + v * m.cosine};
  };
}

/// Frames of the smooth scene, each with its own noise: 512 DN black, 4 DN/e-, 14 bits.
struct Burst {
  int width = 256;
  int height = 192;
  double mean_e = 20;
  double read_noise_e = 2;
  bool find_defects = false;
  /// Camera RGB of a white of the scene.
  Vector3 neutral{0.5, 1, 0.625};
  /// Changes a frame after its exposure.
  std::function<void(RawFrame&, int)> disturb = {};
  /// Exposure of a frame relative to the first.
  std::function<double(int)> light = [](int) { return 1.0; };
  /// Mean signal of the scene at a position of frame 0 [e-]. A pixel collects at most 1e6: it is saturated long before.
  std::function<double(double x, double y, int colour)> scene = {};
  /// Position of frame 0 whose content is at a pixel of a frame.
  std::function<std::array<double, 2>(int index, double x, double y)> position = {};

  double scene_e(double x, double y, int colour) const {
    return scene ? scene(x, y, colour) : smooth_scene(x, y, colour, mean_e);
  }
  double truth_e(int x, int y, int index = 0) const {
    const auto colour = static_cast<int>(colour_at(BayerPhase::grbg, x, y));
    if (!position || index == 0) return scene_e(x, y, colour);
    const auto [u, v] = position(index, x, y);
    return scene_e(u, v, colour);
  }

  /// Returns the mean signal of frame 0 [e-].
  double mean_truth_e() const {
    double sum = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) sum += truth_e(x, y);
    }
    return sum / (static_cast<double>(width) * height);
  }

  RawFrame frame_as_exposed(int index) const {
    Plane<float> mean(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        mean.at(x, y) = static_cast<float>(std::min(light(index) * truth_e(x, y, index), 1e6));
    }
    const Plane<float> charge_e = noisy_frame(mean, 0, read_noise_e, 77, static_cast<std::uint32_t>(index));
    RawFrame frame = night_frame({.phase = BayerPhase::grbg, .read_noise_e = read_noise_e},
                                 denoise_testing::flat(1, 1, 1), width, height);
    for (std::size_t i = 0; i < charge_e.size(); ++i) {
      const double dn = night_black_dn + night_gain_dn_per_e * static_cast<double>(charge_e.data()[i]);
      frame.raw.dn.data()[i] = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, night_white_dn)));
    }
    frame.raw.info.make = "Test";
    frame.raw.info.model = "Burst";
    frame.raw.info.exposure_s = 0.1 * light(index);
    frame.raw.info.iso = 800;
    return frame;
  }

  RawFrame frame(int index) const {
    RawFrame out = frame_as_exposed(index);
    out.colour.as_shot_neutral = neutral;
    if (disturb) disturb(out, index);
    return out;
  }

  /// Neither dark charge nor lines are estimated: the scene has regular waves and no neutral colour.
  isp::DevelopOptions options() const {
    isp::DevelopOptions out{.estimate_dark = false, .find_defects = find_defects};
    out.denoise.line_noise = false;
    return out;
  }

  isp::MergedRaw merged(int count, const isp::MergeOptions& options_of_merge = {}, Executor* executor = nullptr) const {
    InlineExecutor one;
    const isp::FrameReader read = [this](int index, bool) {
      return Result<isp::FrameToMerge>({frame(index), options()});
    };
    auto result = merge_frames(count, read, options_of_merge, executor != nullptr ? *executor : one);
    EXPECT_TRUE(result) << result.error().message;
    return *std::move(result);
  }

  /// Returns the signal of a frame [e-]; `white_e` is the signal of its white level.
  static double signal_e(const RawFrame& frame, int x, int y, double white_e = night_full_e()) {
    const double black = frame.raw.black_tag->pattern_dn[0];
    const double value = frame.raw.is_float() ? frame.raw.dn_float.at(x, y) : frame.raw.dn.at(x, y);
    return (value - black) / (frame.raw.white_dn[1] - black) * white_e;
  }

  double mean_square_error(const RawFrame& frame, double white_e = night_full_e()) const {
    return mean_square_error(frame, {0, 0, width, height}, white_e);
  }
  double mean_square_error(const RawFrame& frame, const Rect& part, double white_e = night_full_e()) const {
    double sum = 0;
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) {
        sum += std::pow(signal_e(frame, x, y, white_e) - truth_e(x, y), 2);
      }
    }
    return sum / (static_cast<double>(part.width) * part.height);
  }

  /// Returns the mean variance that the NoiseProfile states [e-^2].
  double stated_variance(const RawFrame& frame, double white_e = night_full_e()) const {
    double sum = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto c = static_cast<std::size_t>(colour_at(BayerPhase::grbg, x, y));
        sum += (frame.noise->scale[c] * truth_e(x, y) / white_e + frame.noise->offset[c]) * white_e * white_e;
      }
    }
    return sum / (static_cast<double>(width) * height);
  }
};

}  // namespace lowlux::test
