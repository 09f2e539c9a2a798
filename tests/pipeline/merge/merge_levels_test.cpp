#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/pipeline/merge/merge_ways.h"

namespace lowlux::isp {
namespace {

using test::Burst;
using test::MergeWay;
using test::tried;

/// Black and white level of a frame [DN].
struct Levels {
  double black_dn, white_dn;
};

TEST(MergeLevels, FramesOfDifferentBlackAndWhiteLevelsAreAveragedByTheirLight) {
  constexpr std::uint64_t seed = 27;
  std::mt19937_64 draw(seed);
  std::uniform_real_distribution<double> black(100, 4000), white(12000, 16383), light(5, 250);
  for (int i = 0; i < 3; ++i) {
    const double level_e = light(draw);
    Burst burst{.width = 160, .height = 128, .mean_e = level_e};
    std::vector<Levels> levels(4);
    for (Levels& one : levels) one = {std::round(black(draw)), std::round(white(draw))};
    burst.disturb = [&](RawFrame& frame, int index) {
      const auto [black_dn, white_dn] = levels[static_cast<std::size_t>(index)];
      test::change_levels(frame, black_dn, white_dn);
    };
    const double white_e = (levels[0].white_dn - levels[0].black_dn) / test::night_gain_dn_per_e;
    const double scene_e = burst.mean_truth_e();
    for (const MergeWay& way : test::ways_without_stars()) {
      const std::string where = way.name + ", level " + std::to_string(level_e) + " e-, seed " + std::to_string(seed);
      const auto merged = tried(way.of(burst), 4, way.options);
      ASSERT_TRUE(merged) << where << merged.error().message;
      test::expect_finite(*merged, where);
      EXPECT_NEAR(test::mean_e(*merged, white_e), scene_e, 5 * std::sqrt((scene_e + 4) / (burst.width * burst.height)))
          << where;
      if (way.options.drizzle || way.bracket) continue;
      EXPECT_NEAR(burst.mean_square_error(merged->frame, white_e) / (scene_e + 4), 0.25, 0.05) << where;
    }
  }
}

TEST(MergeLevels, MonochromeFramesKeepTheirLightAndNoiseAtEveryLevel) {
  constexpr std::uint64_t seed = 5;
  std::mt19937_64 draw(seed);
  const double white_e = (test::night_white_dn - test::night_black_dn) / test::night_gain_dn_per_e;
  std::uniform_real_distribution<double> log_light(std::log(5.0), std::log(0.5 * white_e));
  for (int i = 0; i < 4; ++i) {
    const double level_e = std::exp(log_light(draw));
    Burst burst{.width = 160, .height = 128, .mean_e = level_e, .neutral = {1, 1, 1}};
    burst.disturb = [](RawFrame& frame, int) { frame.raw.layout = SensorLayout::monochrome; };
    const double scene_e = burst.mean_truth_e();
    for (const MergeWay& way : test::ways_without_stars()) {
      if (way.bracket) continue;
      const std::string where = way.name + ", level " + std::to_string(level_e) + " e-, seed " + std::to_string(seed);
      const auto merged = tried(way.of(burst), 4, way.options);
      if (way.options.drizzle) {
        ASSERT_FALSE(merged) << where << ", which has no colours";
        EXPECT_EQ(merged.error().code, ErrorCode::unsupported);
        continue;
      }
      ASSERT_TRUE(merged) << where << merged.error().message;
      EXPECT_NEAR(test::mean_e(*merged, white_e), scene_e, 5 * std::sqrt((scene_e + 4) / (burst.width * burst.height)))
          << where;
      EXPECT_NEAR(burst.mean_square_error(merged->frame, white_e) / (scene_e + 4), 0.25, 0.05) << where;
      const RawFrame one = way.of(burst).frame(0);
      EXPECT_NEAR(merged->frame.noise->offset[1] / one.noise->offset[1], 0.25, 0.05) << where;
      EXPECT_NEAR(merged->frame.noise->scale[1] / one.noise->scale[1], 0.25, 0.05) << where;
    }
  }
}

TEST(MergeLevels, OrientationAndCropAreThoseOfTheReference) {
  constexpr std::uint64_t seed = 31;
  std::mt19937_64 draw(seed);
  std::uniform_int_distribution<int> orientation(1, 8), offset(0, 20);
  Burst burst{.width = 96, .height = 80};
  std::vector<Orientation> orientations;
  std::vector<Rect> crops;
  for (int i = 0; i < 4; ++i) {
    orientations.push_back(static_cast<Orientation>(orientation(draw)));
    const int x = offset(draw), y = offset(draw);
    crops.push_back({x, y, 96 - x - offset(draw), 80 - y - offset(draw)});
  }
  Burst turned = burst;
  turned.disturb = [&](RawFrame& frame, int index) {
    frame.raw.info.orientation = orientations[static_cast<std::size_t>(index)];
    frame.raw.default_crop = crops[static_cast<std::size_t>(index)];
  };
  for (MergeWay way : test::ways_without_stars()) {
    for (const int reference : {0, 2}) {
      way.options.reference = reference;
      const std::string where =
          way.name + ", reference " + std::to_string(reference) + ", seed " + std::to_string(seed);
      const auto expected = tried(way.of(burst), 4, way.options), merged = tried(way.of(turned), 4, way.options);
      ASSERT_TRUE(expected && merged) << where;
      // The mosaics lie as the sensor reads them out, however the camera was held.
      EXPECT_TRUE(test::same_samples(merged->frame.raw, expected->frame.raw)) << where;
      const auto index = static_cast<std::size_t>(reference);
      EXPECT_EQ(merged->frame.raw.info.orientation, orientations[index]) << where;
      if (way.options.drizzle) continue;  // its pixels are smaller
      EXPECT_EQ(merged->frame.raw.default_crop, crops[index]) << where;
    }
  }
}

TEST(MergeLevels, DrizzlingThatMemoryHasNoRoomForIsRefused) {
  const Burst burst{.width = 96, .height = 80};
  int with_drizzling = 0;
  for (MergeWay way : test::ways_without_stars()) {
    if (!way.options.drizzle) continue;
    ++with_drizzling;
    const double scale = way.options.drizzle->scale;
    const double needed = 52 * std::round(burst.width * scale) * std::round(burst.height * scale);
    way.options.memory_limit_bytes = 0.97 * needed;
    const auto refused = tried(way.of(burst), 4, way.options);
    ASSERT_FALSE(refused) << way.name;
    EXPECT_EQ(refused.error().code, ErrorCode::too_large);
    EXPECT_TRUE(refused.error().message.starts_with("drizzling 96 x 80 pixels to ")) << refused.error().message;
    way.options.memory_limit_bytes = 1.03 * needed;
    EXPECT_TRUE(tried(way.of(burst), 4, way.options)) << way.name;
  }
  EXPECT_GT(with_drizzling, 0);
}

TEST(MergeLevels, ActiveAreasThatBeginElsewhereAreRefused) {
  Burst burst{.width = 64, .height = 48};
  burst.disturb = [](RawFrame& frame, int index) {
    frame.raw.active = {index == 1 ? 2 : 0, 0, 62, 48};
    frame.raw.default_crop = {0, 0, 62, 48};
  };
  for (const MergeWay& way : test::ways_without_stars()) {
    const auto merged = tried(way.of(burst), 3, way.options);
    ASSERT_FALSE(merged) << way.name;
    EXPECT_EQ(merged.error().code, ErrorCode::invalid_argument) << way.name;
    EXPECT_EQ(merged.error().where, "frame 1") << way.name;
    EXPECT_NE(merged.error().message.find("its active area begins at 2, 0"), std::string::npos) << way.name;
  }
}

}  // namespace
}  // namespace lowlux::isp
