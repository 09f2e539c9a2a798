#include "isp/merge/exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr std::array<double, 3> unsaturated{infinite, infinite, infinite};

Plane<float> scene_of(int width, int height, double level) {
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto colour = static_cast<int>(colour_at(BayerPhase::rggb, x, y));
      out.at(x, y) = static_cast<float>(test::smooth_scene(x, y, colour, level));
    }
  }
  return out;
}

TEST(Exposure, TheRatioOfLightIsMeasuredWithinItsStandardError) {
  InlineExecutor executor;
  const auto variance = test::dark_variance_e2(0, 2);
  double chi_square = 0;
  int count = 0;
  for (const double level : {3.0, 30.0, 1000.0}) {
    for (const double stated : {0.0625, 0.5, 4.0}) {
      for (const double error : {0.9, 1.0, 1.07}) {
        const Plane<float> reference = test::noisy_frame(scene_of(256, 192, level), 0, 2, 8, 0);
        const Plane<float> frame = test::noisy_frame(scene_of(256, 192, level * stated * error), 0, 2, 8, 1);
        const auto found = measure_light_ratio({reference.view(), BayerPhase::rggb, variance},
                                               {frame.view(), BayerPhase::rggb, variance}, stated, executor);
        if (!found) continue;  // too dark for 2 %
        chi_square += std::pow((found->ratio - stated * error) / found->standard_error, 2);
        ++count;
      }
    }
  }
  EXPECT_GE(count, 24);
  EXPECT_LT(chi_square, count + 5 * std::sqrt(2.0 * count));
}

TEST(Exposure, MovingObjectsDoNotChangeTheRatio) {
  InlineExecutor executor;
  const auto variance = test::dark_variance_e2(0, 2);
  Plane<float> changed = scene_of(256, 256, 400);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) changed.at(x, y) *= 3;
  }
  const Plane<float> reference = test::noisy_frame(scene_of(256, 256, 200), 0, 2, 8, 0);
  const Plane<float> frame = test::noisy_frame(changed, 0, 2, 8, 1);
  const auto found = measure_light_ratio({reference.view(), BayerPhase::rggb, variance},
                                         {frame.view(), BayerPhase::rggb, variance}, 2.1, executor);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->ratio, 2, 5 * found->standard_error);
}

TEST(Exposure, WithoutUsableBlocksThereIsNoRatio) {
  InlineExecutor executor;
  const auto variance = test::dark_variance_e2(0, 2);
  const Plane<float> dark = test::flat_mosaic(256, 256, 0);
  const Plane<float> saturated = test::flat_mosaic(256, 256, std::numeric_limits<float>::quiet_NaN());
  const FrameView a{dark.view(), BayerPhase::rggb, variance}, b{saturated.view(), BayerPhase::rggb, variance};
  EXPECT_FALSE(measure_light_ratio(a, b, 2, executor));
  EXPECT_FALSE(measure_light_ratio(a, a, 2, executor));
  const Plane<float> small = test::flat_mosaic(1, 30, 100);
  const FrameView c{small.view(), BayerPhase::rggb, variance};
  EXPECT_FALSE(measure_light_ratio(c, c, 1, executor));
}

TEST(Exposure, WeightsAreInverseVariancesThatDoNotDependOnTheSite) {
  InlineExecutor executor;
  Plane<float> frame = test::flat_mosaic(20, 20, 60);
  frame.at(8, 8) = 5000;
  Plane<float> weight(20, 20);
  inverse_variance_weights({frame.view(), BayerPhase::rggb, test::dark_variance_e2(5, 3)}, 0.5, unsaturated,
                           weight.view(), executor);
  EXPECT_FLOAT_EQ(weight.at(3, 3), 0.25F / 74);
  EXPECT_FLOAT_EQ(weight.at(0, 0), 0.25F / 74);
  EXPECT_FLOAT_EQ(weight.at(8, 8), 0.25F / 74);
  EXPECT_FLOAT_EQ(weight.at(10, 8), 0.25F / (14 + (7 * 60.0F + 5000) / 8));
}

TEST(Exposure, WeightsFadeTowardsSaturation) {
  InlineExecutor executor;
  const std::array<double, 3> saturation{100, 100, 100};
  for (const auto& [level, fade] : {std::pair{80.0F, 1.0F}, {90.0F, 0.5F}, {96.0F, 0.0F}}) {
    const Plane<float> frame = test::flat_mosaic(12, 12, level);
    Plane<float> weight(12, 12);
    inverse_variance_weights({frame.view(), BayerPhase::rggb, {}}, 1, saturation, weight.view(), executor);
    EXPECT_NEAR(weight.at(5, 5), fade / level, 1e-5);
  }
  Plane<float> frame = test::flat_mosaic(12, 12, 50);
  frame.at(5, 5) = 120;
  Plane<float> weight(12, 12);
  remove_saturated(frame.view(), BayerPhase::rggb, saturation, weight.view(), executor);
  EXPECT_TRUE(std::isnan(frame.at(5, 5)));
  EXPECT_EQ(weight.at(5, 5), 1);
  EXPECT_EQ(weight.at(5, 6), 0);
  inverse_variance_weights({frame.view(), BayerPhase::rggb, {}}, 1, saturation, weight.view(), executor);
  EXPECT_EQ(weight.at(5, 5), 0);
  EXPECT_FLOAT_EQ(weight.at(7, 5), 7.0F / 8 / 50);
}

}  // namespace
}  // namespace lowlux::merge
