#include <gtest/gtest.h>

#include <cstring>

#include "denoise/denoiser.h"
#include "denoise/temporal/temporal.h"
#include "tests/denoise/frames.h"
#include "tests/support/count_allocations.h"
#include "tests/support/only_target.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::Level;

const Camera camera{.dark_e = {3, 3, 3, 3}};

/// The brightest are saturated.
denoise::RawNoise noise() {
  auto out = camera.noise();
  out.saturation_e.fill(150);
  return out;
}

/// Tiles of different signal to noise ratio, and stars.
Plane<float> night(int width, int height) {
  auto raw = exposed(
      camera,
      [width](int x, int y) {
        const double e = 0.1 * std::pow(2000.0, static_cast<double>(x) / width), wave = 1 + 0.3 * std::sin(0.1 * y);
        return std::array{e, e * wave, e};
      },
      width, height, 61);
  for (int y = 30; y < height - 30; y += 50) {
    for (int i = 0; i < 4; ++i) raw.at(31 + i % 2, y + i / 2) += 60;
  }
  return raw;
}

TEST(DenoiserThreads, GiveTheSameBits) {
  for (const Level level : denoise::all_levels) {
    const int width = level == Level::best ? 301 : 901, height = level == Level::best ? 203 : 403;
    const auto raw = night(width, height);
    Plane<float> first;
    for (const int threads : {1, 2, 3, 7}) {
      PoolExecutor pool(threads);
      denoise::Denoiser denoiser(width, height, threads, level);
      Plane<float> out(width, height);
      denoiser.run({raw.view(), camera.phase}, noise(), {.level = level}, out.view(), {}, pool);
      if (threads == 1) first = out.clone();
      EXPECT_EQ(std::memcmp(first.data(), out.data(), out.size() * sizeof(float)), 0) << threads;
    }
  }
}

TEST(DenoiserThreads, MayBeMoreThanThereIsMemoryFor) {
  const auto raw = night(300, 200);
  Plane<float> one(300, 200), three(300, 200);
  PoolExecutor pool(3);
  denoise::Denoiser denoiser(300, 200, 1);
  InlineExecutor alone;
  denoiser.run({raw.view(), camera.phase}, noise(), {}, one.view(), {}, alone);
  denoiser.run({raw.view(), camera.phase}, noise(), {}, three.view(), {}, pool);
  EXPECT_EQ(std::memcmp(one.data(), three.data(), one.size() * sizeof(float)), 0);
}

// What an earlier, larger frame left in the buffers must not be seen by a smaller one.
TEST(DenoiserMemory, OfEarlierFramesDoesNotShow) {
  const auto large = night(700, 300), small = night(333, 127);
  denoise::Denoiser used(700, 300, 1, Level::best), fresh(333, 127, 1, Level::best);
  Plane<float> out_large(700, 300), after(333, 127), before(333, 127);
  InlineExecutor one;
  for (const Level level : {Level::best, Level::high, Level::standard}) {
    used.run({large.view(), camera.phase}, noise(), {.level = level}, out_large.view(), {}, one);
    used.run({small.view(), camera.phase}, noise(), {.level = level}, after.view(), {}, one);
    fresh.run({small.view(), camera.phase}, noise(), {.level = level}, before.view(), {}, one);
    EXPECT_EQ(std::memcmp(before.data(), after.data(), after.size() * sizeof(float)), 0);
  }
}

TEST(DenoiserMemory, IsAllocatedByTheConstructorOnly) {
  const auto raw = night(500, 300);
  Plane<float> out(500, 300), residual(250, 150), confidence(250, 150);
  PoolExecutor two(2);
  const long at_first = test::allocations;
  denoise::Denoiser denoiser(500, 300, 2, Level::best);
  EXPECT_GT(test::allocations, at_first);
  const long before = test::allocations;
  for (const Level level : denoise::all_levels) {
    denoiser.run({raw.view(), camera.phase}, noise(), {.level = level}, out.view(),
                 {residual.view(), confidence.view()}, two);
  }
  EXPECT_EQ(test::allocations, before);
}

TEST(TemporalMemory, IsAllocatedByTheConstructorOnly) {
  const auto raw = night(500, 300);
  Plane<float> out(500, 300), share(250, 150);
  PoolExecutor two(2);
  const long at_first = test::allocations;
  denoise::TemporalMean temporal(500, 300, 2);
  EXPECT_GT(test::allocations, at_first);
  const long before = test::allocations;
  for (const double light : {1.0, 1.0, 2.0}) {
    temporal.run({raw.view(), camera.phase}, noise(), light, {}, out.view(), share.view(), two);
  }
  temporal.reset();
  EXPECT_EQ(test::allocations, before);
}

TEST(DenoiserTargets, AgreeWithinFloatRounding) {
  const auto raw = night(300, 200);
  for (const Level level : {Level::standard, Level::best}) {
    const auto run = [&] {
      Plane<float> out(300, 200);
      InlineExecutor one;
      denoise::Denoiser(300, 200, 1, level)
          .run({raw.view(), camera.phase}, noise(), {.level = level}, out.view(), {}, one);
      return out;
    };
    const auto best = run();
    EXPECT_STREQ(denoise::denoiser_target(), hwy::TargetName(test::kernel_targets().front()));
    for (const std::int64_t target : test::kernel_targets()) {
      const test::OnlyTarget only(target);
      ASSERT_STREQ(denoise::denoiser_target(), hwy::TargetName(target));
      const auto out = run();
      double worst = 0;
      for (std::size_t i = 0; i < out.size(); ++i) {
        worst = std::max(worst, std::abs(static_cast<double>(out.data()[i]) - static_cast<double>(best.data()[i])));
      }
      EXPECT_LT(worst, 1e-3) << hwy::TargetName(target);  // [e-]: 5e-6 of the largest value, 200 e-
    }
  }
}

}  // namespace
}  // namespace lowlux
