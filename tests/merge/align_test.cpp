#include "isp/merge/align/align.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "tests/support/moving_scene.h"

namespace lowlux::test::align_test {
namespace {

using merge::AlignOptions;
using merge::AlignReference;
using merge::Motion;

constexpr int width = 384, height = 256;
constexpr double degree = std::numbers::pi / 180;

Executor& two_threads() {
  static PoolExecutor executor(2);
  return executor;
}

View still() {
  return [](Position p) { return p; };
}

Light waves(std::uint64_t seed, double contrast = 0.4) {
  return [scene = WaveScene(seed, contrast, 0.15, 24)](Position p, CfaColour c) { return scene.at(p, c); };
}

/// Two frames of a scene, the second one displaced.
struct Pair {
  Exposure first{.frame = 0};
  Exposure second{.frame = 1};
  Plane<float> reference;
  Plane<float> frame;

  Motion motion(Executor& executor = two_threads(), const AlignOptions& options = {}) const {
    const AlignReference prepared(frame_view(reference, first), executor);
    return find_motion(prepared, frame_view(frame, second), second.mean_e / first.mean_e, options, executor);
  }
};

Pair expose_pair(const Light& light, const View& view, double mean_e, std::uint32_t index = 0, int columns = width,
                 int rows = height, double ratio = 1) {
  Pair pair;
  pair.first = {.mean_e = mean_e, .frame = 2 * index};
  pair.second = {.mean_e = mean_e * ratio, .frame = 2 * index + 1};
  pair.reference = expose(light, still(), columns, rows, pair.first, two_threads());
  pair.frame = expose(light, view, columns, rows, pair.second, two_threads());
  return pair;
}

/// Returns the largest displacement of a node; NaN if one is not finite.
double largest_px(const Motion& motion) {
  double largest = 0;
  for (const Plane<float>* plane : {&motion.dx_px, &motion.dy_px}) {
    for (std::size_t i = 0; i < plane->size(); ++i) {
      if (!std::isfinite(plane->data()[i])) return std::numeric_limits<double>::quiet_NaN();
      largest = std::max(largest, std::fabs(static_cast<double>(plane->data()[i])));
    }
  }
  return largest;
}

void expect_not_found(const Pair& pair) {
  const Motion motion = pair.motion();
  EXPECT_FALSE(motion.found);
  EXPECT_EQ(largest_px(motion), 0);
}

TEST(Align, RigidMotionIsWithinATwentiethOfAPixelAt20Electrons) {
  std::mt19937 random(11);
  const auto drawn = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  for (std::uint32_t i = 0; i < 8; ++i) {
    const View view = rigid_view(width, height, drawn(20), drawn(20), drawn(1) * degree);
    const Motion motion = expose_pair(waves(i + 1), view, 20, i).motion();
    ASSERT_TRUE(motion.found) << "pair " << i;
    EXPECT_LT(rms_error_px(motion, view, width, height), 0.05) << "pair " << i;
    EXPECT_LT(motion.standard_error_px, 0.05) << "pair " << i;
  }
}

TEST(Align, ErrorsAreThosePredictedAtLightLevelsDrawnAtRandom) {
  std::mt19937 random(12);
  const auto drawn = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  double ratios = 0;
  int found = 0;
  for (std::uint32_t i = 0; i < 12; ++i) {
    const double mean_e = 3 * std::exp(std::log(300) * std::uniform_real_distribution<double>(0, 1)(random));
    const View view = rigid_view(width, height, drawn(25), drawn(25), drawn(1.5) * degree);
    const Motion motion = expose_pair(waves(100 + i), view, mean_e, i).motion();
    if (!motion.found) continue;
    ++found;
    const double ratio = rms_error_px(motion, view, width, height) / motion.standard_error_px;
    // Errors of nodes are not independent: three parameters of a rigid motion, so 4 standard errors.
    EXPECT_LT(ratio, 4) << "pair " << i << ", " << mean_e << " e-";
    ratios += ratio * ratio;
  }
  EXPECT_EQ(found, 12);
  // The sum over 12 pairs has at least 24 degrees of freedom: 5 standard errors above 1. Predictions contain a reserve
  // for aliasing, so that errors may be smaller.
  EXPECT_LT(ratios / found, 1 + 5 * std::sqrt(2.0 / 24));
}

// Interpolation takes noise from a frame, which may not make a displacement between its cells more likely.
TEST(Align, InLittleLightMotionsAreRightOrNotFound) {
  std::mt19937 random(13);
  const auto drawn = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  int found = 0;
  for (std::uint32_t i = 0; i < 80; ++i) {
    const double mean_e = std::exp(drawn(std::log(0.2), std::log(2)));
    const View view = rigid_view(width, height, drawn(-25, 25), drawn(-25, 25), drawn(-1.5, 1.5) * degree);
    const Motion motion = expose_pair(waves(300 + i), view, mean_e, i).motion();
    if (!motion.found) continue;
    ++found;
    // Three parameters: chi-square above 3 * 2.5^2 has a probability of 3e-4 for each pair.
    EXPECT_LT(rms_error_px(motion, view, width, height), 2.5 * motion.standard_error_px) << "pair " << i;
  }
  EXPECT_GE(found, 30);
}

TEST(Align, ShiftsTo128PixelsAndRotationsTo5DegreesAreFound) {
  constexpr int columns = 640, rows = 512;
  const struct { double dx, dy, turn; } cases[] = {{127, -120, 0}, {-128, 40, 1}, {10, -20, 5}, {-60, 60, -4.9}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const View view = rigid_view(columns, rows, cases[i].dx, cases[i].dy, cases[i].turn * degree);
    const Motion motion = expose_pair(waves(200 + i), view, 20, i, columns, rows).motion();
    ASSERT_TRUE(motion.found) << "case " << i;
    EXPECT_LT(rms_error_px(motion, view, columns, rows), 0.05) << "case " << i;
  }
}

TEST(Align, PureNoiseHasNoMotion) {
  for (const double mean_e : {0.0, 0.3, 20.0, 2000.0}) {
    SCOPED_TRACE(mean_e);
    const Light flat = [](Position, CfaColour) { return 1.0; };
    Pair pair = expose_pair(flat, still(), mean_e);
    pair.second.mean_e = pair.first.mean_e = std::max(mean_e, 1.0);  // for the ratio of light
    expect_not_found(pair);
  }
}

TEST(Align, FramesWithoutValuesOrContrastHaveNoMotion) {
  for (const float value : {0.0F, 50.0F, std::numeric_limits<float>::quiet_NaN()}) {
    Pair pair;
    for (Plane<float>* plane : {&pair.reference, &pair.frame}) {
      *plane = Plane<float>(width, height);
      std::fill_n(plane->data(), plane->size(), value);
    }
    SCOPED_TRACE(value);
    expect_not_found(pair);
  }
}

TEST(Align, DifferentScenesHaveNoMotion) {
  for (std::uint64_t seed = 300; seed < 306; seed += 2) {
    Pair pair = expose_pair(waves(seed), still(), 20);
    pair.frame = expose(waves(seed + 1), still(), width, height, pair.second, two_threads());
    expect_not_found(pair);
  }
}

TEST(Align, MissingSitesAndSaturatedRegionsDoNotDisplace) {
  const View view = rigid_view(width, height, 7.3, -4.6, 0.4 * degree);
  Pair pair = expose_pair(waves(400), view, 20);
  std::mt19937 random(13);
  constexpr float missing = std::numeric_limits<float>::quiet_NaN();
  for (Plane<float>* plane : {&pair.reference, &pair.frame}) {
    for (std::size_t i = 0; i < plane->size(); ++i) {
      if (plane->data()[i] > 40 || random() % 100 == 0) plane->data()[i] = missing;  // saturation, defects
    }
    for (int y = 100; y < 150; ++y) std::fill_n(plane->row(y) + 60, 90, missing);
  }
  const Motion motion = pair.motion();
  ASSERT_TRUE(motion.found);
  EXPECT_LT(rms_error_px(motion, view, width, height), 0.15);
}

TEST(Align, PeriodicPatternsGetASmallestMotionThatMatches) {
  const Light stripes = [](Position p, CfaColour) { return 1 + 0.5 * std::sin(2 * std::numbers::pi * p.x / 16); };
  const Light checks = [](Position p, CfaColour) {
    return 1 + 0.5 * std::sin(2 * std::numbers::pi * p.x / 16) * std::sin(2 * std::numbers::pi * p.y / 16);
  };
  for (const bool is_checked : {false, true}) {
    const View view = rigid_view(width, height, 3, 0, 0);
    const Motion motion = expose_pair(is_checked ? checks : stripes, view, 100).motion();
    if (!motion.found) {
      EXPECT_EQ(largest_px(motion), 0);
      continue;
    }
    const merge::Shift centre = motion.at(width / 2.0F, height / 2.0F);
    // A shift along the stripes is not determined; across them, by whole periods.
    const double across = std::remainder(static_cast<double>(centre.dx_px) - 3, is_checked ? 8 : 16);
    EXPECT_LT(std::fabs(across), 0.1) << (is_checked ? "checks" : "stripes");
    EXPECT_LT(largest_px(motion), 12) << (is_checked ? "checks" : "stripes");
  }
}

TEST(Align, MovingObjectBendsTheFieldOnlyAtItsOwnTiles) {
  const View background = rigid_view(width, height, 6.4, -3.2, 0);
  const Light scene = waves(500), object = waves(501, 0.8);
  // A square of 64 pixels moves by (2, 9) while the background moves as above.
  const auto composed = [&](double dx, double dy, const View& view) -> std::pair<Light, View> {
    return {[=](Position p, CfaColour c) {
              const bool inside = std::fabs(p.x - 190 - dx) < 32 && std::fabs(p.y - 120 - dy) < 32;
              return inside ? object({p.x - dx, p.y - dy}, c) : scene(view(p), c);
            },
            still()};
  };
  Pair pair;
  const auto [first, first_view] = composed(0, 0, still());
  const auto [second, second_view] = composed(2, 9, background);
  pair.reference = expose(first, first_view, width, height, pair.first, two_threads());
  pair.frame = expose(second, second_view, width, height, pair.second, two_threads());
  const Motion motion = pair.motion();
  ASSERT_TRUE(motion.found);
  for (int y = 0; y < height; y += motion.spacing_px) {
    for (int x = 0; x < width; x += motion.spacing_px) {
      const bool is_far = std::abs(x - 190) > 32 + 32 || std::abs(y - 120) > 32 + 32;
      if (!is_far) continue;
      const merge::Shift s = motion.at(static_cast<float>(x), static_cast<float>(y));
      EXPECT_NEAR(static_cast<double>(s.dx_px), 6.4, 0.1) << x << ", " << y;
      EXPECT_NEAR(static_cast<double>(s.dy_px), -3.2, 0.1) << x << ", " << y;
    }
  }
}

TEST(Align, TinyFramesHaveNoMotionAndSmallOnesAFiniteOne) {
  std::mt19937 random(14);
  const int sides[] = {1, 2, 3, 7, 15, 16, 17, 33, 63};
  for (const int columns : sides) {
    for (const int rows : sides) {
      const Motion motion = expose_pair(waves(600), rigid_view(columns, rows, 1, 0, 0), 50, 0, columns, rows).motion();
      if (std::min(columns, rows) < 16) {
        EXPECT_FALSE(motion.found) << columns << " x " << rows;
      }
      EXPECT_LT(largest_px(motion), 64) << columns << " x " << rows;
      EXPECT_TRUE(std::isfinite(motion.standard_error_px)) << columns << " x " << rows;
    }
  }
}

TEST(Align, ExposuresMayDifferByFactorsTo16) {
  for (const double ratio : {1.0 / 16, 0.25, 0.96, 4.0, 16.0}) {
    const View view = rigid_view(width, height, -8.7, 5.1, -0.6 * degree);
    Pair pair = expose_pair(waves(700), view, 40, 0, width, height, ratio);
    const Motion motion = pair.motion();
    ASSERT_TRUE(motion.found) << ratio;
    const double error = rms_error_px(motion, view, width, height);
    EXPECT_LT(error, 4 * motion.standard_error_px) << ratio;
    EXPECT_LT(error, 0.2) << ratio;
  }
}

TEST(Align, BitsAreTheSameForEveryNumberOfThreads) {
  const View view = rigid_view(327, 261, -8.7, 5.1, 0.8 * degree);
  Pair pair = expose_pair(waves(800), view, 10, 0, 327, 261);
  for (int y = 40; y < 60; ++y) pair.frame.row(y)[3 * y] = std::numeric_limits<float>::quiet_NaN();
  PoolExecutor one(1);
  const Motion expected = pair.motion(one);
  ASSERT_TRUE(expected.found);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor executor(threads);
    const Motion motion = pair.motion(executor);
    EXPECT_EQ(motion.standard_error_px, expected.standard_error_px) << threads;
    EXPECT_EQ(std::memcmp(motion.dx_px.data(), expected.dx_px.data(), expected.dx_px.size() * sizeof(float)), 0);
    EXPECT_EQ(std::memcmp(motion.dy_px.data(), expected.dy_px.data(), expected.dy_px.size() * sizeof(float)), 0);
  }
}

}  // namespace
}  // namespace lowlux::test::align_test
