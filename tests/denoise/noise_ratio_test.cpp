// Noise that differs from place to place: RawElectronsView::noise_ratio.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>

#include "denoise/denoiser.h"
#include "tests/denoise/against_reference.h"
#include "tests/denoise/draws.h"
#include "tests/denoise/mixed_frames.h"

namespace lowlux::noise_ratio_test {
namespace {

using namespace denoise_testing;
using denoise::DenoiseOptions;
using denoise::Level;

/// Squares of ratios from 1/32 to 4 without order.
NoiseRatio scattered(int width, int height, int block_px) {
  NoiseRatio out{.block_px = block_px,
                 .ratio = Plane<float>(ratio_blocks(width, block_px), ratio_blocks(height, block_px))};
  for (std::size_t i = 0; i < out.ratio.size(); ++i) {
    out.ratio.data()[i] = std::exp2(static_cast<float>(i * i * 7 % 8) - 5);
  }
  return out;
}

bool same(const Plane<float>& a, const Plane<float>& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST(NoiseRatio, AgreesWithTheReferenceAtEveryLevelSizeAndOffset) {
  for (const auto& [width, height] : {std::array{64, 48}, {2, 2}, {3, 5}, {131, 37}, {300, 260}}) {
    for (const int block_px : {8, 16, 5}) {
      if (width == 300 && block_px != 8) continue;  // the reference is slow
      const Camera camera{.phase = BayerPhase::grbg, .dark_e = {10, 12, 11, 9}};
      const auto raw = exposed(camera, waves(20), width, height, 7);
      const NoiseRatio ratio = scattered(width + 40, height + 40, block_px);
      for (const Level level : denoise::all_levels) {
        const DenoiseOptions options{.level = level, .white_gain = {1.9, 1, 1.4}, .keep_point_sources = false};
        compare(camera, camera.noise(), raw, options, view_of(&ratio).from(width % 40, 17));
      }
    }
  }
}

TEST(NoiseRatio, OfOneChangesNoBit) {
  const Camera camera{.dark_e = {3, 3, 3, 3}};
  auto raw = exposed(camera, waves(9), 301, 203, 8);
  for (int i = 0; i < 4; ++i) raw.at(100 + i % 2, 60 + i / 2) += 60;  // a star
  NoiseRatio ones = scattered(301, 203, 8);
  std::fill_n(ones.ratio.data(), ones.ratio.size(), 1.0f);
  for (const Level level : denoise::all_levels) {
    EXPECT_TRUE(
        same(denoised(raw, camera, {}, {.level = level}), denoised(raw, camera, view_of(&ones), {.level = level})));
  }
}

TEST(NoiseRatio, GivesTheSameBitsForEveryNumberOfThreads) {
  const Camera camera{.dark_e = {3, 3, 3, 3}};
  const Mixed frame = mixed(camera, waves(9), 501, 303, 4, 8, checked(3), 9);
  for (const Level level : denoise::all_levels) {
    const auto first = denoised(frame.both, camera, view_of(&frame.ratio), {.level = level});
    for (const int threads : {2, 3, 7}) {
      EXPECT_TRUE(same(first, denoised(frame.both, camera, view_of(&frame.ratio), {.level = level}, threads)))
          << threads;
    }
  }
}

/// Sums of squared errors where a mosaic is single, and where it is a mean.
std::array<test::MeanOf, 2> errors_of(const Plane<float>& got, const Mixed& frame, const Camera& camera,
                                      const Scene& scene) {
  std::array<test::MeanOf, 2> out;
  for (int y = 0; y < got.height(); ++y) {
    for (int x = 0; x < got.width(); ++x) {
      const double error = static_cast<double>(got.at(x, y)) - mean_e(camera, scene, x, y);
      out[frame.is_single(x, y) ? 1 : 0].add(error * error);
    }
  }
  return out;
}

double db_of(const test::MeanOf& squares, const test::MeanOf& other) {
  return 10 * std::log10(squares.mean() / other.mean());
}

double db_of_all(const std::array<test::MeanOf, 2>& above, const std::array<test::MeanOf, 2>& below) {
  return 10 * std::log10((above[0].mean() + above[1].mean()) / (below[0].mean() + below[1].mean()));
}

/// Edges, texture and flats in colours.
Scene detailed(double mean_e) {
  return [mean_e](int x, int y) {
    const double square = (x / 96 + y / 80) % 3 == 0 ? 0.3 : (x / 96 + y / 80) % 3 == 1 ? 1 : 2.2;
    const double grain = (x / 96) % 4 == 1 ? 1 + 0.3 * std::sin(0.7 * x) * std::sin(0.5 * y) : 1;
    const double stripes = (y / 80) % 3 == 2 && (x + y) / 6 % 2 == 0 ? 0.6 : 1;
    const double e = mean_e * square * grain * stripes;
    return std::array{0.8 * e, e, 0.6 * e};
  };
}

// Both halves have their own thresholds: each is as if all of the frame had its noise, except for blocks on the border.
TEST(NoiseRatio, CostsNoHalfOfAFrameMoreThanAFewHundredthsOfADecibel) {
  constexpr int width = 1536, height = 512, frames = 8;
  const Scene scene = detailed(10);
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const Mixed frame = mixed(
      camera, scene, width, height, frames, 8, [](int column, int) { return column >= width / 2 / 8; }, 31);
  std::printf("error of the half of one frame / of %d frames, over that of a frame of this noise alone [dB]\n", frames);
  for (const Level level : denoise::all_levels) {
    const DenoiseOptions options{.level = level};
    const auto both = errors_of(denoised(frame.both, camera, view_of(&frame.ratio), options), frame, camera, scene);
    const auto single = errors_of(denoised(frame.single, camera, {}, options), frame, camera, scene);
    const auto mean =
        errors_of(denoised(frame.mean, camera, view_of(&frame.everywhere), options), frame, camera, scene);
    std::printf("%-9s %+.3f / %+.3f\n", std::string(name_of(level)).c_str(), db_of(both[1], single[1]),
                db_of(both[0], mean[0]));
    EXPECT_LT(db_of(both[1], single[1]), 0.15);
    EXPECT_LT(db_of(both[0], mean[0]), 0.15);
  }
}

struct SquareLimits {
  int blocks;  // along a side of a square
  double mean_db;
};

// Blocks of the transform that straddle both kinds have one threshold, and means lose to the noise next to them: the
// limits are about what was measured. With one noise for all, either the single frames keep their noise, or the means
// lose their detail, which costs more.
TEST(NoiseRatio, IsBetterThanOneNoiseForAllWhereSquaresAlternate) {
  const Scene scene = detailed(10);
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  std::printf(
      "error of squares of one frame / of 8, over that of frames of this noise alone; of all, over that with "
      "the noise of one frame, of 8 for all [dB]\n");
  for (const SquareLimits& limits : {SquareLimits{2, 3.2}, {4, 2.1}, {8, 1.4}}) {
    const Mixed frame = mixed(camera, scene, 768, 512, 8, 8, checked(limits.blocks), 33);
    for (const Level level : denoise::all_levels) {
      const auto errors = [&](const Plane<float>& raw, const NoiseRatioView& ratio) {
        return errors_of(denoised(raw, camera, ratio, {.level = level}), frame, camera, scene);
      };
      const auto both = errors(frame.both, view_of(&frame.ratio));
      const auto as_single = errors(frame.both, {}), as_mean = errors(frame.both, view_of(&frame.everywhere));
      const double single_db = db_of(both[1], errors(frame.single, {})[1]);
      const double mean_db = db_of(both[0], errors(frame.mean, view_of(&frame.everywhere))[0]);
      std::printf("%2d px %-9s %+.2f / %+.2f   %+.2f %+.2f\n", 8 * limits.blocks, std::string(name_of(level)).c_str(),
                  single_db, mean_db, db_of_all(both, as_single), db_of_all(both, as_mean));
      EXPECT_LT(single_db, 0.15);
      EXPECT_LT(mean_db, limits.mean_db);
      EXPECT_LT(db_of_all(both, as_single), -1);
      EXPECT_LT(db_of_all(both, as_mean), -1);
    }
  }
}

/// A dark scene with a lamp in the corner of some squares of 16 px, which have the noise of a short exposure: a raw
/// that is merged from a bracket.
struct Bracketed {
  Plane<float> raw;
  Plane<float> truth_e;
  NoiseRatio ratio;
};

Bracketed bracketed(const Camera& camera, int side_px, float dark_scene_e, float lamp_e, float lamp_ratio,
                    std::uint64_t seed) {
  constexpr int block_px = 16;
  const int blocks = ratio_blocks(side_px, block_px);
  Bracketed out{Plane<float>(side_px, side_px),
                Plane<float>(side_px, side_px),
                {.block_px = block_px, .ratio = Plane<float>(blocks, blocks)}};
  std::fill_n(out.ratio.ratio.data(), out.ratio.ratio.size(), 1.0f);
  std::fill_n(out.truth_e.data(), out.truth_e.size(), dark_scene_e);
  for (std::uint32_t i = 0; i < 6; ++i) {
    const PhiloxWords words = words_at({.seed = seed}, i, 0);
    const int column = 1 + static_cast<int>(words[0] % static_cast<std::uint32_t>(blocks - 2));
    const int row = 1 + static_cast<int>(words[1] % static_cast<std::uint32_t>(blocks - 2));
    const int width = 2 + static_cast<int>(words[2] % 6), height = 2 + static_cast<int>(words[3] % 6);
    out.ratio.ratio.at(column, row) = lamp_ratio;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.truth_e.at(block_px * column + x, block_px * row + y) = lamp_e;
    }
  }
  for (int y = 0; y < side_px; ++y) {
    for (int x = 0; x < side_px; ++x) {
      const float r = view_of(&out.ratio).at(x, y);
      const double charge = test::noisy_charge_e(static_cast<std::uint32_t>(seed), x, y, out.truth_e.at(x, y) / r,
                                                 camera.read_noise_e / std::sqrt(r));
      out.raw.at(x, y) = static_cast<float>(r * charge);
    }
  }
  return out;
}

/// Returns the largest change of a raw value that is left. A change d of more than 5 sigma becomes 10 sigma - d, with
/// sigma^2 = ratio (mean + variance) and, where the change is upwards, value + d for the mean. With c = 25 ratio this
/// has its maximum where 5 sigma = d, the root of d^2 = c (value + d + variance), or, if that root is below value + d +
/// variance = c, there: 10 sigma - d = c + value + variance.
double max_change_e(double value_e, bool is_upwards, double ratio, double variance_e2) {
  const double c = 25 * ratio, level = value_e + variance_e2;
  const double of_value = std::sqrt(c * (std::max(value_e, 0.02) + variance_e2));
  if (!is_upwards) return of_value;
  return std::max(of_value, level >= 0 ? c / 2 + std::sqrt(c * (c / 4 + level)) : c + level);
}

// Thresholds next to a lamp are those of its noise, which leaves errors that are many times the noise of the dark
// sites.
TEST(NoiseRatio, NextToLampsNoValueIsFurtherThanFiveStandardDeviationsFromItsRawValue) {
  const std::uint32_t seed = std::random_device{}();
  std::printf("seed %u\n", seed);
  int kept = 0;  // values that are at the limit
  for (std::uint32_t draw = 0; draw < 12; ++draw) {
    const PhiloxWords words = words_at({.seed = seed}, draw, 1);
    const auto log_uniform = [](std::uint32_t word, double least, double most) {
      return static_cast<float>(least * std::pow(most / least, word / 4294967296.0));
    };
    const Camera camera{.phase = static_cast<BayerPhase>(words[0] % 4), .white_gain = {1.9, 1, 1.4}};
    const float scene_e = log_uniform(words[1], 2, 50), lamp_e = scene_e * log_uniform(words[2], 1e3, 1e6);
    const float lamp_ratio = log_uniform(words[3], 30, 900);
    const Bracketed frame = bracketed(camera, 192, scene_e, lamp_e, lamp_ratio, seed + draw);
    for (const Level level : denoise::all_levels) {
      const Plane<float> got =
          denoised(frame.raw, camera, view_of(&frame.ratio), {.level = level, .white_gain = camera.white_gain});
      for (int y = 0; y < got.height(); ++y) {
        for (int x = 0; x < got.width(); ++x) {
          const auto value = static_cast<double>(frame.raw.at(x, y)), result = static_cast<double>(got.at(x, y));
          const double max_e = max_change_e(value, result > value, static_cast<double>(view_of(&frame.ratio).at(x, y)),
                                            camera.read_noise_e * camera.read_noise_e);
          EXPECT_LE(std::abs(result - value), 1.0001 * max_e)
              << x << ',' << y << ' ' << name_of(level) << ", seed " << seed << ", draw " << draw;
          kept += std::abs(result - value) > 0.9 * max_e ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(kept, 0);
}

TEST(NoiseRatio, AgreesWithTheReferenceNextToLamps) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Camera camera{.phase = BayerPhase::gbrg, .dark_e = {1, 2, 1, 1}};
    const Bracketed frame = bracketed(camera, 96, 2, 1e4F, 200, seed);
    for (const Level level : denoise::all_levels) {
      const DenoiseOptions options{.level = level, .white_gain = {1.9, 1, 1.4}, .keep_point_sources = false};
      compare(camera, camera.noise(), frame.raw, options, view_of(&frame.ratio));
    }
  }
}

}  // namespace
}  // namespace lowlux::noise_ratio_test
