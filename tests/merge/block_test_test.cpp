#include "isp/merge/block_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge {
namespace {

struct Rate {
  double blocks = 0;
  double sites = 0;
  double count = 0;
};

/// Compares frames of a static scene with a mean of `averaged` others.
Rate false_alarms(const Plane<float>& mean_e, double dark_e, double read_e, int averaged, double light,
                  const ComparisonOptions& options, std::uint64_t seed, int frames) {
  InlineExecutor executor;
  const auto variance = test::dark_variance_e2(dark_e, read_e);
  Plane<float> bright = mean_e.clone();
  for (float* v = bright.data(); v != bright.data() + bright.size(); ++v) *v *= static_cast<float>(light);
  Rate rate;
  for (int i = 0; i < frames; ++i) {
    Plane<float> reference = test::flat_mosaic(mean_e.width(), mean_e.height(), 0);
    for (int k = 0; k < averaged; ++k) {
      const Plane<float> one = test::noisy_frame(mean_e, dark_e, read_e, seed, static_cast<std::uint32_t>(100 * i + k));
      for (std::size_t j = 0; j < one.size(); ++j) reference.data()[j] += one.data()[j] / static_cast<float>(averaged);
    }
    Plane<float> frame =
        test::noisy_frame(bright, dark_e, read_e, seed, static_cast<std::uint32_t>(100 * i + averaged));
    for (float* v = frame.data(); v != frame.data() + frame.size(); ++v) *v /= static_cast<float>(light);
    const Comparison result = compare_mosaics(reference.view(), {variance, 1.0 / averaged}, frame.view(),
                                              noise_in_light(variance, light), options, executor);
    for (std::size_t j = 0; j < result.block_matches.size(); ++j) rate.blocks += 1 - result.block_matches.data()[j];
    rate.sites += static_cast<double>(result.outliers);
    rate.count += static_cast<double>(result.block_matches.size());
  }
  return rate;
}

TEST(BlockTest, AStaticSceneIsRejectedAtTheStatedRate) {
  std::mt19937_64 draw(7);
  for (int i = 0; i < 24; ++i) {
    const double level = std::pow(10, std::uniform_real_distribution(0.0, 3.5)(draw));
    const double read = std::pow(10, std::uniform_real_distribution(-0.3, 0.7)(draw));
    const double dark = i % 3 == 0 ? 0 : std::pow(10, std::uniform_real_distribution(-1.0, 2.3)(draw));
    const double light = i % 4 == 0 ? std::pow(2, std::uniform_real_distribution(-3.0, 3.0)(draw)) : 1;
    const int averaged = i % 2 == 0 ? 1 : 5;
    const double rate = i % 5 == 0 ? 1e-2 : 1e-3;
    SCOPED_TRACE(testing::Message() << level << " e-, read " << read << ", dark " << dark << ", light " << light
                                    << ", mean of " << averaged << ", rate " << rate);
    const Plane<float> scene = test::flat_mosaic(512, 512, static_cast<float>(level));
    const Rate found = false_alarms(scene, dark, read, averaged, light, {.block_false_alarm = rate}, 5 + i, 4);
    const double expected = rate * found.count, error = 5 * std::sqrt(3 * expected);
    EXPECT_LT(found.blocks, 3 * expected + error);
    if (level * light > 3 && level > 3) {
      EXPECT_GT(found.blocks, 0.15 * expected - error);
    }
  }
}

TEST(BlockTest, DetailAndStarsOfAStaticSceneMatch) {
  Plane<float> scene(512, 512);
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      double e = test::smooth_scene(x, y, static_cast<int>(colour_at(BayerPhase::rggb, x, y)), 20);
      const double u = std::remainder(x, 37.3), v = std::remainder(y, 41.7);
      e += 20000 * std::exp(-(u * u + v * v) / 2);
      scene.at(x, y) = static_cast<float>(e);
    }
  }
  const Rate one = false_alarms(scene, 3, 2, 1, 1, {}, 11, 6);
  EXPECT_LT(one.blocks, 4e-3 * one.count);
  const Rate mean = false_alarms(scene, 3, 2, 5, 1, {.site_false_alarm = 1e-5}, 12, 6);
  EXPECT_LT(mean.blocks, 4e-3 * mean.count);
  EXPECT_LT(mean.sites, 4e-5 * 64 * mean.count + 10);
}

TEST(BlockTest, SitesOfAStaticSceneAreOutliersAtTheStatedRate) {
  for (const double level : {0.5, 4.0, 20.0, 300.0}) {
    const Plane<float> scene = test::flat_mosaic(1024, 512, static_cast<float>(level));
    const Rate found = false_alarms(scene, 0, 2, 5, 1, {.site_false_alarm = 1e-4}, 21, 4);
    const double expected = 1e-4 * 64 * found.count;
    EXPECT_LT(found.sites, 2.5 * expected) << level;
    EXPECT_GT(found.sites, 0.3 * expected) << level;
  }
}

TEST(BlockTest, AChangeOfOneStandardDeviationIsFound) {
  // A square of 24 x 24 sites differs by one standard deviation of the difference: found in all but few blocks.
  for (const double level : {1.0, 10.0, 100.0}) {
    const Plane<float> scene = test::flat_mosaic(256, 256, static_cast<float>(level));
    Plane<float> changed = scene.clone();
    const double sigma = std::sqrt(2 * (level + 4));
    for (int y = 96; y < 120; ++y) {
      for (int x = 96; x < 120; ++x) changed.at(x, y) += static_cast<float>(sigma);
    }
    InlineExecutor executor;
    const auto variance = test::dark_variance_e2(0, 2);
    int found = 0;
    for (std::uint32_t i = 0; i < 20; ++i) {
      const Plane<float> reference = test::noisy_frame(scene, 0, 2, 3, 2 * i);
      Plane<float> frame = test::noisy_frame(changed, 0, 2, 3, 2 * i + 1);
      const Comparison result =
          compare_mosaics(reference.view(), {variance, 1}, frame.view(), {variance, 1}, {}, executor);
      for (int y = 12; y < 15; ++y) {
        for (int x = 12; x < 15; ++x) found += 1 - result.block_matches.at(x, y);
      }
    }
    EXPECT_GE(found, 176) << level;  // of 180
  }
}

TEST(BlockTest, ABrightSiteIsRemovedAndItsBlockKept) {
  const Plane<float> scene = test::flat_mosaic(64, 64, 20);
  Plane<float> frame = test::noisy_frame(scene, 0, 2, 9, 1);
  frame.at(21, 30) = 5000;
  frame.at(40, 8) = std::numeric_limits<float>::quiet_NaN();
  InlineExecutor executor;
  const auto variance = test::dark_variance_e2(0, 2);
  const Comparison result =
      compare_mosaics(scene.view(), {variance, 0.2}, frame.view(), {variance, 1}, {.site_false_alarm = 1e-6}, executor);
  EXPECT_EQ(result.outliers, 1);
  EXPECT_TRUE(std::isnan(frame.at(21, 30)));
  EXPECT_EQ(result.block_matches.at(2, 3), 1);
}

TEST(BlockTest, IsTheSameForAnyNumberOfThreadsAndAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {2, 2}, {7, 9}, {131, 67}}) {
    const Plane<float> scene = test::flat_mosaic(width, height, 12);
    const Plane<float> reference = test::noisy_frame(scene, 0, 2, 9, 0);
    const auto variance = test::dark_variance_e2(0, 2);
    InlineExecutor one;
    Plane<float> frame = test::noisy_frame(scene, 0, 2, 9, 1);
    const Comparison expected =
        compare_mosaics(reference.view(), {variance, 1}, frame.view(), {variance, 1}, {.site_false_alarm = 1e-2}, one);
    for (const int threads : {2, 3, 7}) {
      PoolExecutor pool(threads);
      Plane<float> again = test::noisy_frame(scene, 0, 2, 9, 1);
      const Comparison result = compare_mosaics(reference.view(), {variance, 1}, again.view(), {variance, 1},
                                                {.site_false_alarm = 1e-2}, pool);
      EXPECT_EQ(result.mean_chi_square, expected.mean_chi_square);
      EXPECT_EQ(result.outliers, expected.outliers);
      for (std::size_t i = 0; i < result.block_matches.size(); ++i) {
        EXPECT_EQ(result.block_matches.data()[i], expected.block_matches.data()[i]);
      }
    }
  }
}

TEST(BlockTest, OneComparerJudgesManyBlocksAsEachComparisonDoes) {
  const Plane<float> scene = test::flat_mosaic(128, 128, 20);
  const Plane<float> reference = test::noisy_frame(scene, 0, 2, 9, 0);
  Plane<float> frame = test::noisy_frame(scene, 0, 2, 9, 1);
  for (int y = 60; y < 100; ++y) {
    for (int x = 50; x < 90; ++x) frame.at(x, y) += 6;
  }
  const MosaicNoise one{test::dark_variance_e2(0, 2), 1}, mean{test::dark_variance_e2(0, 2), 0.25};
  const ComparisonOptions options{.block_false_alarm = 1e-2};
  const MosaicComparer comparer(mean, one, options);
  InlineExecutor executor;
  int matching = 0;
  for (int y = 0; y < 128; y += block_px) {
    for (int x = 0; x < 128; x += block_px) {
      const auto crop = [&](auto& mosaic) { return mosaic.view().crop(x, y, block_px, block_px); };
      const Comparison found = comparer.compare(crop(reference), crop(frame), executor);
      const Comparison expected = compare_mosaics(crop(reference), mean, crop(frame), one, options, executor);
      EXPECT_EQ(found.block_matches.at(0, 0), expected.block_matches.at(0, 0));
      EXPECT_EQ(found.mean_chi_square, expected.mean_chi_square);
      matching += found.block_matches.at(0, 0);
    }
  }
  EXPECT_GT(matching, 150);
  EXPECT_LT(matching, 256 - 16);  // 25 blocks are those of the object
}

TEST(BlockTest, WithoutAnyValueNothingIsCompared) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Plane<float> reference = test::flat_mosaic(32, 32, nan);
  Plane<float> frame = test::flat_mosaic(32, 32, 5);
  InlineExecutor executor;
  const Comparison result = compare_mosaics(reference.view(), {test::dark_variance_e2(0, 2), 1}, frame.view(),
                                            {test::dark_variance_e2(0, 2), 1}, {}, executor);
  EXPECT_EQ(result.mean_chi_square, 0);
  EXPECT_EQ(result.matching_fraction, 0);
  EXPECT_EQ(result.block_matches.at(1, 1), 1);
}

}  // namespace
}  // namespace lowlux::merge
