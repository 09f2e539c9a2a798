#include "isp/raw/measure/dark_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr double electrons_at_white = 8000;

/// Describes blocks m = d + L n (1 + deviation) whose light L rises evenly from `min_light_e`.
struct Scene {
  std::array<double, 3> dark_e{};
  Vector3 neutral{0.5, 1, 0.66};  // relative to green
  Vector3 deviation{};            // of the darkest surfaces from neutral, natural logarithm
  double min_light_e = 0;
  double max_light_e = 200;
  int width = 60, height = 40;
};

CameraRgb blocks_of(const Scene& s) {
  CameraRgb out(s.width, s.height);
  const int n = s.width * s.height;
  for (int i = 0; i < n; ++i) {
    // Neighbours are alike, as those that are joined are in pictures.
    const int row = i / s.width;
    const double place = 1.0 * row / s.height + 1e-6 * (i % s.width);
    const double light = s.min_light_e + (s.max_light_e - s.min_light_e) * place;
    for (std::size_t c = 0; c < 3; ++c) {
      const double colour = s.neutral[c] * std::exp(s.deviation[c] * (1 - place));
      out.plane[c].data()[i] = static_cast<float>((s.dark_e[c] + light * colour) / electrons_at_white);
    }
  }
  return out;
}

std::optional<DarkEstimate> estimate_of(const CameraRgb& blocks, std::optional<Vector3> neutral = {},
                                        double pixels = 1e4, const Plane<float>* clipped = nullptr) {
  return estimate_dark_charge({.mean = blocks,
                               .electrons_at_white = {electrons_at_white, electrons_at_white, electrons_at_white},
                               .variance_e2 = {4, 4, 4},
                               .pixels = pixels,
                               .neutral = neutral,
                               .clipped = clipped});
}

/// Makes a fraction of the pixels of some blocks as bright as white in each colour.
Plane<float> saturate(CameraRgb& blocks, const std::function<double(int x, int y)>& fraction) {
  Plane<float> out(blocks.width(), blocks.height());
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      out.at(x, y) = static_cast<float>(fraction(x, y));
      for (Plane<float>& plane : blocks.plane) plane.at(x, y) += out.at(x, y) * (1 - plane.at(x, y));
    }
  }
  return out;
}

TEST(DarkEstimate, IsExactForGreySurfacesAndEqualDarkCharge) {
  std::mt19937_64 engine(20261123);
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>()(engine));
  };
  for (int i = 0; i < 300; ++i) {
    const double dark = log_uniform(1, 1000);
    const Scene scene{.dark_e = {dark, dark, dark},
                      .neutral = {log_uniform(0.3, 0.75), 1, log_uniform(0.3, 0.75)},
                      .max_light_e = log_uniform(30, 3000)};
    const auto found = estimate_of(blocks_of(scene));
    ASSERT_TRUE(found) << "draw " << i;
    // Blocks are floats: half a unit in the last place of the brightest.
    EXPECT_NEAR(found->mean_e, dark, 2e-6 * (dark + scene.max_light_e)) << "draw " << i;
    EXPECT_LT(found->misfit, 1e-3);
    EXPECT_GT(found->standard_error_e, 0);
  }
}

TEST(DarkEstimate, OfBlocksWithoutLightIsTheirChargeInEachChannel) {
  // Channels that deviate by 5 % (rms), and a darkest fiftieth with next to no light.
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  constexpr int draws = 300;
  int beyond = 0;
  double cast_squares = 0;
  for (int i = 0; i < draws; ++i) {
    Scene scene{.max_light_e = 300};
    for (double& charge : scene.dark_e) charge = 200 * (1 + 0.05 * normal(engine));
    const auto found = estimate_of(blocks_of(scene), scene.neutral);
    ASSERT_TRUE(found);
    const double truth = (scene.dark_e[0] + 2 * scene.dark_e[1] + scene.dark_e[2]) / 4;
    beyond += std::fabs(found->mean_e - truth) > 3 * found->standard_error_e ? 1 : 0;
    // What stays of the charge has the colour of light: hardly a cast.
    const double light = scene.dark_e[1] - found->charge_e[1];
    for (const std::size_t c : {0, 2}) {
      cast_squares += std::pow(scene.dark_e[c] - found->charge_e[c] - light * scene.neutral[c], 2);
    }
  }
  EXPECT_LE(beyond, draws / 50);
  EXPECT_LT(std::sqrt(cast_squares / (2 * draws)), 0.5 * 0.05 * 200) << "half of the deviation between channels";
}

// Lamps fill from a thousandth to half of the pixels of every third block of the brighter half, so that means stay
// below white. Without the number of saturated pixels the lamps' colour, equal in all channels, is taken for that of
// the light, and light of the darkest surfaces for dark charge.
TEST(DarkEstimate, IsNotChangedByBlocksThatHoldSaturatedPixels) {
  constexpr unsigned seed = 20261126;
  std::mt19937_64 engine(seed);
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>()(engine));
  };
  int changed = 0;
  constexpr int draws = 200;
  for (int i = 0; i < draws; ++i) {
    const double dark = log_uniform(2, 200), fraction = log_uniform(1e-3, 0.5);
    const Scene scene{.dark_e = {dark, dark, dark}, .min_light_e = log_uniform(1, 100), .max_light_e = 400};
    const CameraRgb plain = blocks_of(scene);
    CameraRgb blocks = blocks_of(scene);
    const Plane<float> clipped =
        saturate(blocks, [&](int x, int y) { return y > scene.height / 2 && x % 6 < 2 ? fraction : 0; });
    const auto truth = estimate_of(plain), found = estimate_of(blocks, {}, 1e4, &clipped), blind = estimate_of(blocks);
    ASSERT_TRUE(truth && found) << "seed " << seed << ", draw " << i;
    // Lamps that make less than 5 % of the difference of a third of the blocks are not excluded. They add a third of
    // that fraction of light L to each colour of n, and subtract it from d. The second term is the rounding of floats.
    EXPECT_NEAR(found->mean_e, dark, 0.05 / 3 * truth->light_e + 1e-5 * (dark + 400))
        << "seed " << seed << ", draw " << i;
    changed += !blind || std::fabs(blind->mean_e - truth->mean_e) > 1 ? 1 : 0;
  }
  EXPECT_GT(changed, draws / 2) << "without the number of saturated pixels";
}

// At long exposures one pixel in 1000 is saturated by its own dark current, in dark and bright blocks alike.
TEST(DarkEstimate, IsStillMadeWhereAllBlocksHoldHotPixels) {
  std::mt19937_64 engine(4);
  std::uniform_real_distribution<double> even(0.8e-3, 1.2e-3);
  const Scene scene{.dark_e = {50, 50, 50}, .max_light_e = 400};
  CameraRgb blocks = blocks_of(scene);
  const Plane<float> clipped = saturate(blocks, [&](int, int) { return even(engine); });
  const auto found = estimate_of(blocks, {}, 1e4, &clipped);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->is_significant());
  // 8 e- of the mean are those of the saturated pixels, 1.6 e- of them by chance in the blocks that seem darkest.
  EXPECT_NEAR(found->mean_e, 58, 2 * 1.6);
}

TEST(DarkEstimate, CoversDeviationsOfDarkSurfacesByItsStandardError) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  constexpr int draws = 400;
  int beyond = 0, false_alarms = 0;
  double squares = 0;  // mean square of the errors of frames with dark charge, in standard errors
  for (int i = 0; i < draws; ++i) {
    const double dark = i % 2 == 0 ? 0 : 20, t = 0.17 * normal(engine), k = 0.4 * normal(engine);
    const Scene scene{
        .dark_e = {dark, dark, dark},
        .deviation = {t / std::sqrt(6) + k / std::sqrt(2), -2 * t / std::sqrt(6), t / std::sqrt(6) - k / std::sqrt(2)},
        .min_light_e = 10,
        .max_light_e = 400};
    const auto found = estimate_of(blocks_of(scene), Vector3{0.5, 1, 0.66});
    ASSERT_TRUE(found);
    beyond += std::fabs(found->mean_e - dark) > 3 * found->standard_error_e ? 1 : 0;
    if (dark == 0) false_alarms += found->is_significant() ? 1 : 0;
    if (dark > 0) squares += std::pow((found->mean_e - dark) / found->standard_error_e, 2) / (draws / 2.0);
  }
  // One frame in twenty, as the header says.
  EXPECT_LE(beyond, draws / 20);
  EXPECT_LE(false_alarms, draws / 2 / 20);
  // Errors and standard errors agree: a mean square of 1 would be exact, a quarter are errors of half the size.
  EXPECT_LT(squares, 1);
  EXPECT_GT(squares, 0.25);
}

TEST(DarkEstimate, IsCoveredUnderPhotonNoise) {
  constexpr double pixels = 64, dark = 12;
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal;
  const CameraRgb mean = blocks_of({.dark_e = {dark, dark, dark}, .max_light_e = 60});
  double sum = 0, squares = 0;
  constexpr int draws = 200;
  for (int i = 0; i < draws; ++i) {
    CameraRgb noisy(mean.width(), mean.height());
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < mean.plane[c].size(); ++k) {
        const double e = static_cast<double>(mean.plane[c].data()[k]) * electrons_at_white;
        const double std_e = std::sqrt((e + 4) / (pixels * (c == 1 ? 0.5 : 0.25)));
        noisy.plane[c].data()[k] = static_cast<float>((e + std_e * normal(engine)) / electrons_at_white);
      }
    }
    const auto found = estimate_of(noisy, Vector3{0.5, 1, 0.66}, pixels);
    ASSERT_TRUE(found) << "seed 11, draw " << i;
    EXPECT_TRUE(found->is_significant());
    sum += found->mean_e - dark;
    squares += std::pow((found->mean_e - dark) / found->standard_error_e, 2);
  }
  EXPECT_LT(squares / draws, 1) << "mean square of the errors in standard errors";
  EXPECT_LT(std::fabs(sum / draws), 0.1 * dark);
}

TEST(DarkEstimate, IsRefusedIfDarkAndLightCannotBeSeparated) {
  EXPECT_FALSE(estimate_of(blocks_of({.dark_e = {50, 50, 50}, .max_light_e = 0}))) << "no light";
  EXPECT_FALSE(estimate_of(blocks_of({.dark_e = {50, 50, 50}, .neutral = {1, 1, 1}}))) << "light equal in all channels";
  EXPECT_FALSE(estimate_of(blocks_of({.dark_e = {50, 50, 50}, .width = 7, .height = 9}))) << "63 blocks";
  EXPECT_TRUE(estimate_of(blocks_of({.dark_e = {50, 50, 50}, .width = 8, .height = 8}))) << "64 blocks";
  const Scene saturated{.dark_e = {50, 50, 50}, .min_light_e = 9000, .max_light_e = 9001};
  EXPECT_FALSE(estimate_of(blocks_of(saturated)));
  EXPECT_FALSE(estimate_of(CameraRgb(0, 0)));
}

TEST(DarkEstimate, IsNotSignificantWithoutDarkCharge) {
  std::mt19937_64 engine(5);
  for (int i = 0; i < 100; ++i) {
    const double light = std::exp(std::uniform_real_distribution<double>(0, 5)(engine));
    const auto found = estimate_of(blocks_of({.min_light_e = light, .max_light_e = 40 * light}));
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->is_significant()) << light;
    EXPECT_NEAR(found->mean_e, 0, 2e-6 * 40 * light) << "all of the charge of the darkest blocks is light";
  }
}

// A pedestal that is stated too high makes the offset negative. The darkest blocks hold light, so that their charge is
// positive, and none of it is dark charge.
TEST(DarkEstimate, IsNoneWhereThePedestalIsTooHigh) {
  std::mt19937_64 engine(13);
  for (int i = 0; i < 100; ++i) {
    const double offset = -std::exp(std::uniform_real_distribution<double>(0, 4)(engine));
    const Scene scene{.dark_e = {offset, offset, offset}, .min_light_e = -4 * offset, .max_light_e = 500 - 40 * offset};
    const auto found = estimate_of(blocks_of(scene));
    ASSERT_TRUE(found) << offset;
    EXPECT_EQ(found->mean_e, 0) << offset;
    EXPECT_GT(found->light_e, 0) << offset;
  }
}

// Stated neutrals that are not positive are not used, and do no harm.
TEST(DarkEstimate, IgnoresImpossibleNeutrals) {
  const CameraRgb blocks = blocks_of({.dark_e = {30, 30, 30}});
  const auto plain = estimate_of(blocks);
  for (const Vector3& neutral : {Vector3{0, 1, 1}, Vector3{-1, 1, 1}, Vector3{NAN, 1, 1}, Vector3{1, INFINITY, 1}}) {
    EXPECT_EQ(estimate_of(blocks, neutral)->mean_e, plain->mean_e);
  }
}

}  // namespace
}  // namespace lowlux::isp
