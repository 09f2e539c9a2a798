#include "isp/merge/mosaic_mean.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge::mosaic_mean_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

double mean_square_error(const Plane<float>& a, float truth) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a.data()[i] - truth), 2);
  return sum / static_cast<double>(a.size());
}

TEST(MosaicMean, OfFramesHasTheVarianceOfOneOverTheirNumber) {
  InlineExecutor executor;
  for (const int count : {1, 2, 8, 32}) {
    for (const double level : {0.3, 4.0, 200.0}) {
      const Plane<float> scene = test::flat_mosaic(256, 256, static_cast<float>(level));
      MosaicMean mean(256, 256);
      for (int i = 0; i < count; ++i) {
        mean.add(test::noisy_frame(scene, 3, 2, 17, static_cast<std::uint32_t>(i)).view(), {}, executor);
      }
      const double expected = (level + 7) / count;
      const double found = mean_square_error(mean.take_mean(executor), static_cast<float>(level));
      EXPECT_NEAR(found, expected, 5 * expected * std::sqrt(2.5 / (256 * 256))) << count << " of " << level;
    }
  }
}

TEST(MosaicMean, LeavesOutBlocksAndSitesAndWeighsTheOthers) {
  InlineExecutor executor;
  MosaicMean mean(20, 10);
  Plane<float> one = test::flat_mosaic(20, 10, 1), two = test::flat_mosaic(20, 10, 4);
  two.at(0, 0) = nan;
  Plane<std::uint8_t> matches(3, 2);
  for (std::size_t i = 0; i < matches.size(); ++i) matches.data()[i] = 1;
  matches.at(2, 1) = 0;  // columns 16..19, rows 8, 9
  Plane<float> weight = test::flat_mosaic(20, 10, 2);
  weight.at(3, 3) = 0;
  mean.add(one.view(), {}, executor);
  for (int y = 0; y < 10; ++y) {
    mean.add_row(y, {.value = two.row(y), .site_weight = weight.row(y)}, std::as_const(matches).view());
  }
  EXPECT_EQ(mean.weight().at(5, 5), 3);
  EXPECT_EQ(mean.weight().at(17, 9), 1);
  const Plane<float> result = mean.take_mean(executor);
  EXPECT_EQ(result.at(5, 5), 3);
  EXPECT_EQ(result.at(0, 0), 1);
  EXPECT_EQ(result.at(3, 3), 1);
  EXPECT_EQ(result.at(17, 9), 1);
  EXPECT_EQ(result.at(17, 7), 3);
}

TEST(MosaicMean, FillsSitesWithoutValuesFromTheNearestOfTheirColour) {
  InlineExecutor executor;
  MosaicMean mean(100, 8);
  Plane<float> values = test::flat_mosaic(100, 8, nan);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 20; ++x) values.at(x, y) = static_cast<float>(10 * (y % 2) + x % 2);
  }
  values.at(7, 3) = nan;
  values.at(8, 4) = nan;
  mean.add(values.view(), {}, executor);
  const Plane<float> result = mean.take_mean(executor);
  EXPECT_EQ(result.at(7, 3), 11);
  EXPECT_EQ(result.at(8, 4), 0);
  EXPECT_EQ(result.at(45, 2), 1);  // 26 pixels from the last column
  EXPECT_EQ(result.at(61, 3), 0);  // more than 32
}

TEST(MosaicMean, OfNothingIsZero) {
  InlineExecutor executor;
  MosaicMean mean(1, 1);
  EXPECT_EQ(mean.take_mean(executor).at(0, 0), 0);
}

TEST(RobustMean, IgnoresAMinorityAndKeepsTheMean) {
  InlineExecutor executor;
  for (const int count : {3, 5}) {
    const Plane<float> scene = test::flat_mosaic(128, 128, 20);
    std::vector<Plane<float>> frames;
    for (int i = 0; i < count; ++i) frames.push_back(test::noisy_frame(scene, 0, 2, 4, static_cast<std::uint32_t>(i)));
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 128; ++x) {
        if (y % 4 == 0) frames[static_cast<std::size_t>(x % count)].at(x, y) += 500;  // a trail in one frame
        if (y % 4 == 2) frames[static_cast<std::size_t>(x % count)].at(x, y) = nan;
      }
    }
    robust_mean(frames, {test::dark_variance_e2(0, 2), 1}, executor);
    double trail = 0, missing = 0, whole = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 128; ++x) (y % 4 == 0 ? trail : y % 4 == 2 ? missing : whole) += frames[0].at(x, y);
    }
    EXPECT_NEAR(whole / (128 * 64), 20, 5 * std::sqrt(24.0 / count / (128 * 64)));
    EXPECT_NEAR(missing / (128 * 32), 20, 5 * std::sqrt(24.0 / (count - 1) / (128 * 32)));
    EXPECT_NEAR(trail / (128 * 32), 20, 5 * std::sqrt(24.0 / (count - 1) / (128 * 32)) + 0.2);
  }
}

TEST(RobustMean, OfTwoThatDifferIsTheLowerAndOfNoneIsNaN) {
  InlineExecutor executor;
  std::vector<Plane<float>> frames;
  frames.push_back(test::flat_mosaic(4, 2, 900));
  frames.push_back(test::flat_mosaic(4, 2, 20));
  frames[0].at(1, 1) = frames[1].at(1, 1) = nan;
  robust_mean(frames, {test::dark_variance_e2(0, 2), 1}, executor);
  EXPECT_EQ(frames[0].at(0, 0), 20);
  EXPECT_TRUE(std::isnan(frames[0].at(1, 1)));
}

}  // namespace
}  // namespace lowlux::merge::mosaic_mean_test
