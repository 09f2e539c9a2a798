#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "capture/synthetic/optics/lens_blur.h"
#include "tests/capture/synthetic/burst_scene.h"
#include "tests/support/sensor_frames.h"

// The blur of the lens in frames, in their truth and in their plan.
namespace lowlux::capture::lens_blur_frames_test {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;
using test::equal;

/// Bars of colours, and a lamp.
Scene detailed_scene(int width, int height) {
  SceneLinear xyz(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool bright = (x / 3 + y / 5) % 2 == 0;
      xyz.plane[0].at(x, y) = bright ? 0.7F : 0.1F;
      xyz.plane[1].at(x, y) = bright ? 0.5F : 0.12F;
      xyz.plane[2].at(x, y) = bright ? 0.3F : 0.2F;
    }
  }
  Scene scene = *picture_scene(std::move(xyz), 20);
  EXPECT_TRUE(add_lamp(scene, 0.6 * width, 0.4 * height, *isp::light_named("A"), 30));
  return scene;
}

SyntheticSource made(int width, int height, const SyntheticOptions& options) {
  auto source = test::source_of(detailed_scene(width, height), test::plain_sensor(), options);
  EXPECT_TRUE(source) << (source ? "" : source.error().message);
  return *std::move(source);
}

SyntheticOptions with_blur(double sigma_px, NoiseSourceSet effects) {
  SyntheticOptions options;
  options.exposure.time_s = 0.5;
  options.phase = BayerPhase::grbg;
  options.lens_blur_px = sigma_px;
  options.effects.effects = effects;
  return options;
}

TEST(LensBlurFrames, AreTheFramesOfTheBlurredTruth) {
  InlineExecutor one;
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {2, 2}, {37, 5}, {70, 45}}) {
    for (const double sigma : {0.2, 0.9, 4.0}) {
      const SyntheticSource sharp = made(width, height, with_blur(0, {Effect::lens_blur}));
      const SyntheticSource source = made(width, height, with_blur(sigma, {Effect::lens_blur}));
      CameraRgb expected = sharp.signal_e(one);
      SceneLinear xyz = sharp.xyz_cd_m2(one);
      const LensBlur lens(sigma);
      for (int k = 0; k < 3; ++k) {
        lens.apply(expected.plane[k], one);
        lens.apply(xyz.plane[k], one);
      }
      const CameraRgb signal = source.signal_e(one);
      const SceneLinear light = source.xyz_cd_m2(one);
      const Plane<float> dn = source.frame_dn(0, one);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          for (int k = 0; k < 3; ++k) {
            ASSERT_NEAR(signal.plane[k].at(x, y), expected.plane[k].at(x, y), 1e-5 * expected.plane[k].at(x, y));
            ASSERT_EQ(light.plane[k].at(x, y), xyz.plane[k].at(x, y));
          }
          const double e = signal.plane[static_cast<int>(colour_at(BayerPhase::grbg, x, y))].at(x, y);
          ASSERT_NEAR(dn.at(x, y), 512 + 0.5 * e, 1e-6 * (512 + e)) << "floats";
        }
      }
    }
  }
}

TEST(LensBlurFrames, WithoutTheEffectHaveTheBytesAndTruthOfASharpLens) {
  InlineExecutor one;
  const NoiseSourceSet all = NoiseSourceSet::all();
  const SyntheticSource sharp = made(70, 45, with_blur(0, all));
  const SyntheticSource left_out = made(70, 45, with_blur(0.8, all.without(Effect::lens_blur)));
  const SyntheticSource blurred = made(70, 45, with_blur(0.8, all));
  EXPECT_TRUE(equal(left_out.frame(2, one).raw.dn, sharp.frame(2, one).raw.dn));
  EXPECT_FALSE(equal(blurred.frame(2, one).raw.dn, sharp.frame(2, one).raw.dn));
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(equal(left_out.signal_e(one).plane[k], sharp.signal_e(one).plane[k]));
    EXPECT_TRUE(equal(left_out.xyz_cd_m2(one).plane[k], sharp.xyz_cd_m2(one).plane[k]));
    EXPECT_FALSE(equal(blurred.xyz_cd_m2(one).plane[k], sharp.xyz_cd_m2(one).plane[k]));
  }
}

// A point of standard deviation s becomes one of sqrt(s^2 + blur^2), and so the truth of a burst states it.
TEST(LensBlurFrames, WidenPointsByTheRootOfTheSumOfSquares) {
  InlineExecutor one;
  for (const double sigma : {0.4, 1.0, 2.5}) {
    Scene scene = *dark_scene(test::setup_of(64, 64, 1));
    ASSERT_TRUE(add_lamp(scene, 31.3, 32.6, *isp::light_named("D65"), 50));
    SyntheticOptions options = with_blur(sigma, NoiseSourceSet::all());
    const BurstSource burst = test::burst_of(std::move(scene), {}, options);
    const auto points = burst.points(0);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_DOUBLE_EQ(points[0].spread_px, std::hypot(0.7, sigma));
    const test::PlaneMoments m = test::moments_of(burst.signal_e(0, one).plane[1]);
    EXPECT_NEAR(m.x, 31.3, 1e-3);
    EXPECT_NEAR(m.xx, 0.49 + sigma * sigma + 1.0 / 12, 1e-3) << "the square of a pixel has 1/12";
    EXPECT_NEAR(m.yy, m.xx, 1e-3);
    EXPECT_NEAR(m.sum, points[0].signal_e[1], 1e-5 * m.sum) << "no light is lost";
  }
}

TEST(LensBlurFrames, KeepTheEffectInFilesWhereThePlannerLeavesItOut) {
  InlineExecutor one;
  SyntheticOptions options = with_blur(0.01, {});
  options.effects.tolerance = isp::Tolerance{};
  const SyntheticSource source = made(64, 64, options);
  const auto lens = static_cast<std::size_t>(Effect::lens_blur);
  for (const isp::RegionPlan& region : source.plan().regions) {
    EXPECT_FALSE(region.kept.has(Effect::lens_blur)) << "a ten-thousandth of the light moves";
    EXPECT_EQ(region.decisions[lens].reason, isp::NoiseSourceDecision::Reason::negligible);
  }
  for (const isp::RegionPlan& region : source.file_plan().regions) {
    EXPECT_TRUE(region.kept.has(Effect::lens_blur));
    EXPECT_EQ(region.decisions[lens].reason, isp::NoiseSourceDecision::Reason::free);
  }
  options.lens_blur_px = 1;
  const SyntheticSource blurred = made(64, 64, options);
  for (const isp::RegionPlan& region : blurred.plan().regions) {
    EXPECT_TRUE(region.kept.has(Effect::lens_blur));
  }
  options.lens_blur_px = 0;
  const SyntheticSource sharp = made(64, 64, options);
  for (const isp::RegionPlan& region : sharp.file_plan().regions) {
    EXPECT_EQ(region.decisions[lens].reason, isp::NoiseSourceDecision::Reason::absent);
  }
}

TEST(LensBlurFrames, ImpossibleBlursAreRefused) {
  const auto refused = [](const SyntheticOptions& options, const std::string& part) {
    const auto source = test::source_of(detailed_scene(4, 4), test::plain_sensor(), options);
    ASSERT_FALSE(source) << part;
    EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(source.error().message.find(part), std::string::npos) << source.error().message;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double sigma : {-1e-9, 10.001, nan, inf}) {
    refused(with_blur(sigma, NoiseSourceSet::all()), "between 0 and 10 px");
  }
  SyntheticOptions published = with_blur(1, NoiseSourceSet::all());
  published.sampling = PhotonSampling::published;
  refused(published, "lens-blur: leave it out");
  EXPECT_TRUE(test::source_of(detailed_scene(4, 4), test::plain_sensor(), with_blur(10, NoiseSourceSet::all())));
}

}  // namespace
}  // namespace lowlux::capture::lens_blur_frames_test
