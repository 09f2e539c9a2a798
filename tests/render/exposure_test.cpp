#include "isp/render/exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/sweep.h"

namespace lowlux::isp::exposure_test {
namespace {

/// `bright` of 1000 blocks hold `highlight`, the others `level`.
std::vector<float> scene(double level, double highlight, int bright = 20) {
  std::vector<float> blocks(1000, static_cast<float>(level));
  std::fill(blocks.begin(), blocks.begin() + bright, static_cast<float>(highlight));
  return blocks;
}

/// Black blocks whose means scatter by `std`.
std::vector<float> lens_cap(double std) {
  std::mt19937 engine(7);
  std::normal_distribution<float> normal(0, static_cast<float>(std));
  std::vector<float> blocks(4000);
  for (float& block : blocks) block = normal(engine);
  return blocks;
}

/// Exposes grey blocks, whose channels are all their luminance.
AutoExposure exposed(const std::vector<float>& blocks, double noise_floor, const AutoExposureOptions& options = {}) {
  return auto_exposure(blocks, blocks, noise_floor, options);
}

TEST(AutoExposure, PutsTheMedianOnMidGrey) {
  const AutoExposure found = exposed(scene(0.02, 0.05), 0);
  EXPECT_EQ(found.rule, ExposureRule::mid_grey);
  EXPECT_NEAR(std::exp2(found.ev) * 0.02, 0.18, 1e-6);  // the blocks are floats
}

TEST(AutoExposure, LetsHighlightsRiseIntoTheShoulderAsFarAsAllowed) {
  const AutoExposure found = exposed(scene(0.005, 0.5), 0);
  EXPECT_EQ(found.rule, ExposureRule::highlights);
  EXPECT_NEAR(found.ev, std::log2(0.9 / 0.5) + AutoExposureOptions{}.shoulder_ev, 1e-6);
  EXPECT_NEAR(exposed(scene(0.005, 0.5), 0, {.shoulder_ev = 0}).ev, std::log2(0.9 / 0.5), 1e-6);
  EXPECT_NEAR(exposed(scene(0.005, 0.5), 0, {.shoulder_ev = 2}).ev, std::log2(0.9 / 0.5) + 2, 1e-6);
}

TEST(AutoExposure, HoldsTheLargestChannelOfSaturatedColours) {
  // A red flower: a fifth of the light of its largest channel.
  const std::vector<float> luminance = scene(0.05, 0.2), largest = scene(0.05, 1.0);
  const AutoExposure found = auto_exposure(luminance, largest, 0);
  EXPECT_EQ(found.rule, ExposureRule::highlights);
  EXPECT_NEAR(found.ev, std::log2(0.9) + AutoExposureOptions{}.shoulder_ev, 1e-6);
  EXPECT_EQ(auto_exposure(luminance, luminance, 0).rule, ExposureRule::mid_grey);
}

TEST(AutoExposure, KeepsANightAsDarkAsItsKey) {
  // Key of Krawczyk, Myszkowski and Seidel 2005, worked out by hand: log10(0.05 + 1) = 0.02119, 1.03 - 2 / 2.02119.
  EXPECT_NEAR(level_of_median(0.05, 0.18), 0.04048, 1e-5);
  EXPECT_NEAR(level_of_median(0, 0.18), 0.03, 1e-12);
  EXPECT_EQ(level_of_median(5, 0.18), 0.18);
  EXPECT_LT(level_of_median(1.2, 0.18), 0.18);
  EXPECT_EQ(level_of_median(1.4, 0.18), 0.18);
  const std::vector<float> sky = scene(0.002, 0.01);  // 25 cd/m2 saturate: a sky of 0.05 cd/m2
  const AutoExposure night = exposed(sky, 0, {.white_cd_m2 = 25});
  EXPECT_EQ(night.rule, ExposureRule::night);
  EXPECT_NEAR(std::exp2(night.ev) * 0.002, 0.04048, 1e-5);
  const AutoExposure day = exposed(sky, 0, {.white_cd_m2 = 25000});
  EXPECT_EQ(day.rule, ExposureRule::mid_grey);
  EXPECT_EQ(day.ev, exposed(sky, 0).ev);
  double before = 0;
  for (const double luminance : test::ratios(1e-5, 1e4, 1.3)) {  // a brighter scene is never shown darker
    const double level = level_of_median(luminance, 0.18);
    EXPECT_GE(level, before);
    EXPECT_GE(level, 0.03);
    before = level;
  }
}

TEST(AutoExposure, IgnoresLampsSmallerThanOnePercent) {
  const AutoExposure found = exposed(scene(0.005, 1.0, 9), 0);
  EXPECT_EQ(found.rule, ExposureRule::mid_grey);
  EXPECT_NEAR(found.ev, std::log2(0.18 / 0.005), 1e-6);
}

TEST(AutoExposure, NeverDarkensAndNeverGoesBeyondTen) {
  EXPECT_EQ(exposed(scene(0.5, 0.9), 0).rule, ExposureRule::no_gain);
  EXPECT_EQ(exposed(scene(0.5, 0.9), 0).ev, 0);
  EXPECT_EQ(exposed(scene(1e-5, 2e-5), 0).rule, ExposureRule::max_gain);
  EXPECT_EQ(exposed(scene(1e-5, 2e-5), 0).ev, 10);
}

TEST(AutoExposure, HoldsTheNoiseOfBlackBelowItsLevel) {
  const AutoExposure found = exposed(scene(0.001, 0.004), 0.0025);
  EXPECT_EQ(found.rule, ExposureRule::black_noise);
  EXPECT_NEAR(std::exp2(found.ev) * 0.0025, 0.02, 1e-12);
  EXPECT_EQ(exposed(scene(0.001, 0.004), 0.1).rule, ExposureRule::no_gain);
}

TEST(AutoExposure, LeavesALensCapFrameBlackWhetherItsNoiseIsKnownOrNot) {
  for (const double noise_floor : {0.0, 1e-3}) {
    for (const double std : {1e-6, 1e-4, 1e-2}) {
      const AutoExposure found = exposed(lens_cap(std), noise_floor);
      EXPECT_EQ(found.rule, ExposureRule::no_signal);
      EXPECT_EQ(found.ev, 0);
    }
  }
  EXPECT_EQ(exposed(std::vector<float>(100, 0.0f), 0).rule, ExposureRule::no_signal);
}

TEST(AutoExposure, FindsAFaintSignalOverNoiseThatReachesBelowZero) {
  std::vector<float> blocks = lens_cap(1e-4);
  for (std::size_t i = 0; i < blocks.size() / 10; ++i) blocks[i] += 0.01f;
  const AutoExposure found = exposed(blocks, 0);
  EXPECT_GT(found.ev, 5);
  EXPECT_NE(found.rule, ExposureRule::no_signal);
}

TEST(AutoExposure, OfNothingOrOfNoNumbersIsNoSignal) {
  EXPECT_EQ(exposed({}, 0).rule, ExposureRule::no_signal);
  const std::vector<float> nothing(10, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(exposed(nothing, 0).rule, ExposureRule::no_signal);
  std::vector<float> some = scene(0.02, 0.05);
  some[500] = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(exposed(some, 0).ev, std::log2(0.18 / 0.02), 1e-6);
}

TEST(AutoExposure, TwiceTheLightIsOneStopLess) {
  for (const double level : test::ratios(1e-3, 0.05, 1.7)) {
    for (const double contrast : test::ratios(1, 200, 2.3)) {
      const AutoExposure once = exposed(scene(level, level * contrast), 0);
      const AutoExposure twice = exposed(scene(2 * level, 2 * level * contrast), 0);
      if (once.ev < 10 && twice.ev > 0) {
        EXPECT_NEAR(once.ev - twice.ev, 1, 1e-5);
      }
    }
  }
}

TEST(ExposureRules, HaveDistinctNames) {
  EXPECT_EQ(name_of(ExposureRule::mid_grey), "mid-grey");
  EXPECT_EQ(name_of(ExposureRule::night), "night");
  EXPECT_EQ(name_of(ExposureRule::highlights), "highlights");
  EXPECT_EQ(name_of(ExposureRule::black_noise), "black-noise");
  EXPECT_EQ(name_of(ExposureRule::no_gain), "no-gain");
  EXPECT_EQ(name_of(ExposureRule::max_gain), "most-gain");
  EXPECT_EQ(name_of(ExposureRule::no_signal), "no-signal");
}

}  // namespace
}  // namespace lowlux::isp::exposure_test
