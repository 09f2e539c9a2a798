// Where the content of a frame lies in the mean of the previous ones, and what the mean over frames makes of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "denoise/temporal/frame_motion.h"
#include "denoise/temporal/temporal.h"
#include "denoise/temporal/temporal_thresholds.h"
#include "tests/denoise/frames.h"
#include "tests/support/only_target.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::FrameMotion;
using Displacement = denoise::FrameMotion::Displacement;

/// A random texture of waves of 10 to 200 pixels.
Scene texture(std::uint32_t seed, double mean_e) {
  struct Wave {
    double x, y, phase;
  };
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Wave> waves(12);
  for (Wave& w : waves) {
    const double frequency = 0.03 * std::pow(20, uniform(random)), angle = 6.283 * uniform(random);
    w = {frequency * std::cos(angle), frequency * std::sin(angle), 6.283 * uniform(random)};
  }
  return [=](int x, int y) {
    double sum = 0;
    for (const Wave& w : waves) sum += std::cos(w.x * x + w.y * y + w.phase);
    const double e = mean_e * std::max(0.05, 1 + 0.3 * sum);
    return std::array{0.6 * e, e, 0.7 * e};
  };
}

Scene displaced(const Scene& scene, Displacement by) {
  return [=](int x, int y) { return scene(x + by.x, y + by.y); };
}

/// Returns how many of the blocks whose content the mean has were given this displacement, as a fraction.
double found_part(int width, int height, Displacement by, double mean_e, BayerPhase phase, std::uint32_t seed) {
  const Camera camera{.phase = phase, .dark_e = {2, 2, 2, 2}, .read_noise_e = 2};
  const Scene scene = texture(seed, mean_e);
  Plane<float> before = exposed(camera, scene, width, height, 2 * seed);
  for (std::size_t i = 0; i < before.size(); ++i) before.data()[i] -= 2;
  const auto raw = exposed(camera, displaced(scene, by), width, height, 2 * seed + 1);
  Plane<float> share((width + 7) / 8, (height + 7) / 8), out(share.width(), share.height());
  std::fill_n(share.data(), share.size(), 1.0f);
  FrameMotion motion(width, height);
  InlineExecutor one;
  motion.find({raw.view(), phase}, denoise::site_noise(camera.noise(), phase),
              {std::as_const(before).view(), std::as_const(share).view()}, out.view(), {one, 1});
  double found = 0, inside = 0;
  for (int y = 0; y < share.height(); ++y) {
    for (int x = 0; x < share.width(); ++x) {
      const int right = std::min(8 * x + 8, width), bottom = std::min(8 * y + 8, height);
      const bool has_content =
          8 * x + by.x >= 0 && 8 * y + by.y >= 0 && right + by.x <= width && bottom + by.y <= height;
      if (motion.at(x, y) == by) {
        EXPECT_EQ(out.at(x, y) >= FrameMotion::no_content, !has_content) << x << " " << y;
      }
      if (!has_content) continue;
      inside += 1;
      found += motion.at(x, y) == by ? 1 : 0;
    }
  }
  return found / inside;
}

// Tiles at an edge of which the mean has less than half keep the displacement of their neighbours, or none.
TEST(FrameMotion, FindsATranslationOfAnySizeInAnyLight) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::uint32_t draw = 0; draw < 40; ++draw) {
    const int width = static_cast<int>(160 * std::pow(4, uniform(random))),
              height = static_cast<int>(160 * std::pow(4, uniform(random)));
    const double mean_e = 8 * std::pow(100, uniform(random));
    const int reach = std::min({60, width / 4, height / 4});
    const auto even = [&] { return 2 * static_cast<int>((uniform(random) - 0.5) * reach); };
    const Displacement by{even(), even()};
    const auto phase = static_cast<BayerPhase>(draw % 4);
    EXPECT_GT(found_part(width, height, by, mean_e, phase, 100 + draw), 0.93)
        << width << " x " << height << ", " << mean_e << " e-, by " << by.x << " " << by.y;
  }
}

/// A stream without noise, whose content moves by 8 pixels for each frame: blocks become blocks.
TEST(MotionCompensation, OfATranslationByBlocksIsAPlainMean) {
  constexpr int width = 256, height = 192, frames = 9;
  constexpr int columns = width / 8, rows = height / 8;  // of blocks
  const Camera camera{.read_noise_e = 1};
  const Scene scene = [](int x, int y) {
    const double e = 1e5 * (3 + std::sin(0.11 * x + 0.05 * y) + std::cos(0.07 * x - 0.13 * y));
    return std::array{e, e, e};
  };
  denoise::TemporalMean temporal(width, height, 1);
  InlineExecutor one;
  Plane<float> raw(width, height), out(width, height), share(width / 2, height / 2);
  for (int frame = 0; frame < frames; ++frame) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        raw.at(x, y) = static_cast<float>(mean_e(camera, displaced(scene, {8 * frame, -8 * frame}), x, y));
      }
    }
    const double moved = temporal.run({raw.view(), camera.phase}, camera.noise(), 1, {}, out.view(), share.view(), one);
    if (frame < 2) continue;
    EXPECT_EQ(std::memcmp(out.data(), raw.data(), raw.size() * sizeof(float)), 0) << "means of equal values";
    EXPECT_NEAR(moved, 1 - static_cast<double>((columns - 1) * (rows - 1)) / (columns * rows), 1e-9) << "what comes in";
    // Frame 1 started anew everywhere. A block that was there then has been averaged over the frames since.
    for (int y = 0; y < height / 2; ++y) {
      for (int x = 0; x < width / 2; ++x) {
        const int since = std::min({frame - 1, width / 8 - 1 - x / 4, y / 4});
        ASSERT_FLOAT_EQ(share.at(x, y), 1.0f / static_cast<float>(since + 1)) << frame << ": " << x << ", " << y;
      }
    }
  }
}

// A block in a thousand starts anew by chance: motion is not looked for.
TEST(MotionCompensation, OfAStillSceneGivesTheBytesWithoutIt) {
  constexpr int side = 256;
  const Camera camera{.read_noise_e = 2};
  denoise::TemporalMean with(side, side, 1), without(side, side, 1);
  InlineExecutor one;
  Plane<float> a(side, side), b(side, side);
  for (std::uint64_t frame = 0; frame < 12; ++frame) {
    const auto raw = exposed(camera, waves(30), side, side, 600 + frame);
    with.run({raw.view(), camera.phase}, camera.noise(), 1, {}, a.view(), {}, one);
    without.run({raw.view(), camera.phase}, camera.noise(), 1, {.compensate_motion = false}, b.view(), {}, one);
    ASSERT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0) << frame;
  }
}

/// Standard deviation of the last of some frames of a scene that moves, over that of a raw value.
double error_of_moving(double step_px, double light_by_frame) {
  constexpr int side = 256, frames = 12;
  denoise::TemporalMean temporal(side, side, 1);
  InlineExecutor one;
  Plane<float> out(side, side);
  const Camera camera{.read_noise_e = 2};
  double squares = 0, variance = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const double light = std::pow(light_by_frame, frame);
    const int by = 2 * static_cast<int>(step_px * frame / 2);
    const Scene scene = displaced(texture(7, 100 * light), {by, by / 2 & ~1});
    const auto raw = exposed(camera, scene, side, side, 700 + static_cast<std::uint64_t>(frame));
    temporal.run({raw.view(), camera.phase}, camera.noise(), frame == 0 ? 1 : light_by_frame, {}, out.view(), {}, one);
    if (frame + 1 < frames) continue;
    for (int y = 64; y < side - 64; ++y) {
      for (int x = 64; x < side - 64; ++x) {
        const double e = mean_e(camera, scene, x, y);
        squares += std::pow(static_cast<double>(out.at(x, y)) - e, 2);
        variance += e + 4;
      }
    }
  }
  return std::sqrt(squares / variance);
}

// 11 frames after the restart would give 0.30; the displacements' uncertainty and the light's changes cost some of it.
TEST(MotionCompensation, AveragesWhatMovesByWholeCells) {
  for (const double step_px : {2.0, 5.0, 12.0}) {
    for (const double light : {1.0, 1.07, 0.93}) {
      EXPECT_LT(error_of_moving(step_px, light), 0.42) << step_px << " " << light;
    }
  }
}

TEST(MotionCompensation, OfAnyNumbersIsFinite) {
  const std::array odd{std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(),
                       3e38f,
                       -3e38f,
                       1e-45f,
                       0.0f,
                       -5.0f};
  for (const double read_noise_e : {0.0, 2.0}) {
    const Camera camera{.read_noise_e = read_noise_e};
    denoise::TemporalMean temporal(115, 99, 2);
    InlineExecutor one;
    Plane<float> out(115, 99), share(58, 50);
    std::mt19937 random(8);
    for (int frame = 0; frame < 16; ++frame) {
      auto raw = exposed(camera, flat(1, 1, 1), 115, 99, 800 + static_cast<std::uint64_t>(frame));
      for (std::size_t i = 0; i < raw.size(); ++i) {
        if (random() % 4 != 0) raw.data()[i] = odd[random() % odd.size()];
      }
      const double light = std::array{1.0, 1e6, 1e-6, 1.0}[static_cast<std::size_t>(frame % 4)];
      temporal.run({raw.view(), camera.phase}, camera.noise(), light, {}, out.view(), share.view(), one);
      for (std::size_t i = 0; i < out.size(); ++i) ASSERT_LE(std::abs(out.data()[i]), 1e9f);
      for (std::size_t i = 0; i < share.size(); ++i) ASSERT_TRUE(share.data()[i] > 0 && share.data()[i] <= 1);
    }
  }
}

/// The last frame of a pan, with an object that moves on its own, and light that changes.
Plane<float> last_of_pan(int width, int height, int threads, bool compensate = true) {
  const Camera camera{.phase = BayerPhase::gbrg, .dark_e = {3, 3, 3, 3}};
  PoolExecutor pool(threads);
  denoise::TemporalMean temporal(width, height, threads);
  Plane<float> out(width, height), share((width + 1) / 2, (height + 1) / 2);
  const Scene scene = texture(9, 40), other = texture(10, 60);
  for (int frame = 0; frame < 7; ++frame) {
    const auto raw = exposed(
        camera,
        [&](int x, int y) {
          const bool object = std::abs(x - 60 - 9 * frame) < 30 && std::abs(y - 70) < 30;
          return object ? other(x - 9 * frame, y) : scene(x + 3 * frame, y + frame);
        },
        width, height, 900 + static_cast<std::uint64_t>(frame));
    temporal.run({raw.view(), camera.phase}, camera.noise(), frame == 4 ? 1.1 : 1, {.compensate_motion = compensate},
                 out.view(), share.view(), pool);
  }
  return out;
}

TEST(MotionCompensation, GivesTheSameBitsForAnyThreadsAndInstructionSet) {
  for (const auto& size : {std::array{333, 211}, {64, 64}, {65, 190}, {640, 81}}) {
    const auto expected = last_of_pan(size[0], size[1], 1);
    const auto compare = [&](const Plane<float>& out) {
      return std::memcmp(expected.data(), out.data(), out.size() * sizeof(float));
    };
    EXPECT_NE(compare(last_of_pan(size[0], size[1], 1, false)), 0) << "motion is compensated";
    for (const int threads : {2, 3, 7}) EXPECT_EQ(compare(last_of_pan(size[0], size[1], threads)), 0) << threads;
    for (const std::int64_t target : test::kernel_targets()) {
      const test::OnlyTarget only(target);
      EXPECT_EQ(compare(last_of_pan(size[0], size[1], 1)), 0) << hwy::TargetName(target);
    }
  }
}

/// Frames of a pan over a scene with lamps that saturate.
Plane<float> frame_of_lamps(int width, int height, int frame) {
  const Scene scene = texture(11, 300);
  return exposed(
      {.read_noise_e = 2},
      [&](int x, int y) {
        const bool lamp = (x + 6 * frame) % 50 < 6 && (y + 2 * frame) % 40 < 6;
        return lamp ? std::array{5e4, 5e4, 5e4} : scene(x + 6 * frame, y + 2 * frame);
      },
      width, height, 1000 + static_cast<std::uint64_t>(frame));
}

// What a larger frame, another mode or a search that was under way left in memory has no effect.
TEST(MotionCompensation, AfterResetIsThatOfANewMean) {
  constexpr int width = 150, height = 106;
  auto noise = Camera{.read_noise_e = 2}.noise();
  noise.saturation_e.fill(2e4);
  PoolExecutor pool(3);
  denoise::TemporalMean used(333, 211, 3), fresh(width, height, 3);
  Plane<float> large(333, 211), a(width, height), b(width, height);
  for (int frame = 0; frame < 5; ++frame) {
    const auto raw = frame_of_lamps(333, 211, frame);
    used.run({raw.view(), BayerPhase::rggb}, noise, 1, {.compensate_motion = frame != 3}, large.view(), {}, pool);
  }
  for (int frame = 0; frame < 7; ++frame) {
    const auto raw = frame_of_lamps(width, height, frame);
    const denoise::RawElectronsView view{raw.view(), BayerPhase::rggb};
    if (frame == 0) used.reset();
    const double moved = used.run(view, noise, 1, {}, a.view(), {}, pool);
    EXPECT_EQ(moved, fresh.run(view, noise, 1, {}, b.view(), {}, pool)) << frame;
    ASSERT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0) << frame;
  }
}

}  // namespace
}  // namespace lowlux
