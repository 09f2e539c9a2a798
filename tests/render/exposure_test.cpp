#include "isp/render/exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/sweep.h"

namespace lowlux::isp {
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

TEST(AutoExposure, PutsTheMedianOnMidGrey) {
  const AutoExposure found = auto_exposure(scene(0.02, 0.05), 0);
  EXPECT_EQ(found.rule, ExposureRule::mid_grey);
  EXPECT_NEAR(std::exp2(found.ev) * 0.02, 0.18, 1e-6);  // the blocks are floats
}

TEST(AutoExposure, LetsHighlightsRiseIntoTheShoulderAsFarAsAllowed) {
  const AutoExposure found = auto_exposure(scene(0.005, 0.5), 0);
  EXPECT_EQ(found.rule, ExposureRule::highlights);
  EXPECT_NEAR(found.ev, std::log2(0.9 / 0.5) + AutoExposureOptions{}.shoulder_ev, 1e-6);
  EXPECT_NEAR(auto_exposure(scene(0.005, 0.5), 0, {.shoulder_ev = 0}).ev, std::log2(0.9 / 0.5), 1e-6);
  EXPECT_NEAR(auto_exposure(scene(0.005, 0.5), 0, {.shoulder_ev = 2}).ev, std::log2(0.9 / 0.5) + 2, 1e-6);
}

TEST(AutoExposure, IgnoresLampsSmallerThanOnePercent) {
  const AutoExposure found = auto_exposure(scene(0.005, 1.0, 9), 0);
  EXPECT_EQ(found.rule, ExposureRule::mid_grey);
  EXPECT_NEAR(found.ev, std::log2(0.18 / 0.005), 1e-6);
}

TEST(AutoExposure, NeverDarkensAndNeverGoesBeyondTen) {
  EXPECT_EQ(auto_exposure(scene(0.5, 0.9), 0).rule, ExposureRule::no_gain);
  EXPECT_EQ(auto_exposure(scene(0.5, 0.9), 0).ev, 0);
  EXPECT_EQ(auto_exposure(scene(1e-5, 2e-5), 0).rule, ExposureRule::max_gain);
  EXPECT_EQ(auto_exposure(scene(1e-5, 2e-5), 0).ev, 10);
}

TEST(AutoExposure, HoldsTheNoiseOfBlackBelowItsLevel) {
  const AutoExposure found = auto_exposure(scene(0.001, 0.004), 0.0025);
  EXPECT_EQ(found.rule, ExposureRule::black_noise);
  EXPECT_NEAR(std::exp2(found.ev) * 0.0025, 0.02, 1e-12);
  EXPECT_EQ(auto_exposure(scene(0.001, 0.004), 0.1).rule, ExposureRule::no_gain);
}

TEST(AutoExposure, LeavesALensCapFrameBlackWhetherItsNoiseIsKnownOrNot) {
  for (const double noise_floor : {0.0, 1e-3}) {
    for (const double std : {1e-6, 1e-4, 1e-2}) {
      const AutoExposure found = auto_exposure(lens_cap(std), noise_floor);
      EXPECT_EQ(found.rule, ExposureRule::no_signal);
      EXPECT_EQ(found.ev, 0);
    }
  }
  EXPECT_EQ(auto_exposure(std::vector<float>(100, 0.0f), 0).rule, ExposureRule::no_signal);
}

TEST(AutoExposure, FindsAFaintSignalOverNoiseThatReachesBelowZero) {
  std::vector<float> blocks = lens_cap(1e-4);
  for (std::size_t i = 0; i < blocks.size() / 10; ++i) blocks[i] += 0.01f;
  const AutoExposure found = auto_exposure(blocks, 0);
  EXPECT_GT(found.ev, 5);
  EXPECT_NE(found.rule, ExposureRule::no_signal);
}

TEST(AutoExposure, OfNothingOrOfNoNumbersIsNoSignal) {
  EXPECT_EQ(auto_exposure({}, 0).rule, ExposureRule::no_signal);
  const std::vector<float> nothing(10, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(auto_exposure(nothing, 0).rule, ExposureRule::no_signal);
  std::vector<float> some = scene(0.02, 0.05);
  some[500] = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(auto_exposure(some, 0).ev, std::log2(0.18 / 0.02), 1e-6);
}

TEST(AutoExposure, TwiceTheLightIsOneStopLess) {
  for (const double level : test::ratios(1e-3, 0.05, 1.7)) {
    for (const double contrast : test::ratios(1, 200, 2.3)) {
      const AutoExposure once = auto_exposure(scene(level, level * contrast), 0);
      const AutoExposure twice = auto_exposure(scene(2 * level, 2 * level * contrast), 0);
      if (once.ev < 10 && twice.ev > 0) {
        EXPECT_NEAR(once.ev - twice.ev, 1, 1e-5);
      }
    }
  }
}

TEST(ExposureRules, HaveDistinctNames) {
  EXPECT_EQ(name_of(ExposureRule::mid_grey), "mid-grey");
  EXPECT_EQ(name_of(ExposureRule::highlights), "highlights");
  EXPECT_EQ(name_of(ExposureRule::black_noise), "black-noise");
  EXPECT_EQ(name_of(ExposureRule::no_gain), "no-gain");
  EXPECT_EQ(name_of(ExposureRule::max_gain), "most-gain");
  EXPECT_EQ(name_of(ExposureRule::no_signal), "no-signal");
}

}  // namespace
}  // namespace lowlux::isp
