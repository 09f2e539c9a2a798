#include "isp/pipeline/merge/bracket_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "isp/merge/exposure.h"
#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp::bracket_scene_test {
namespace {

using test::Burst;

constexpr int block_px = 16, blocks_along = 32, blocks = blocks_along * blocks_along;

constexpr double saturated_from = 0.99;  // of white: plan_noise.cpp

double limit_e() { return merge::full_weight_fraction * saturated_from * test::night_full_e(); }

/// Blocks of 16 x 16 pixels in random order whose light follows a power law: a fraction u of them is brighter than
/// min_e u^(-1 / exponent).
struct PowerLaw {
  double min_e = 0;
  double exponent = 1;
  std::vector<double> signal_e;

  PowerLaw(double least, double power, std::uint64_t seed) : min_e(least), exponent(power), signal_e(blocks) {
    for (int i = 0; i < blocks; ++i) signal_e[i] = min_e * std::pow((i + 0.5) / blocks, -1 / exponent);
    std::ranges::shuffle(signal_e, std::mt19937_64(seed));
  }
  double fraction_above(double level_e) const {
    return static_cast<double>(std::ranges::count_if(signal_e, [&](double e) { return e > level_e; })) / blocks;
  }
  Burst burst() const {
    Burst out{.width = block_px * blocks_along, .height = block_px * blocks_along};
    out.scene = [this](double x, double y, int) {
      return signal_e[blocks_along * (static_cast<std::size_t>(y) / block_px) + static_cast<std::size_t>(x) / block_px];
    };
    return out;
  }
  /// Returns by how much the logarithm of an extrapolated level may be off: each count by one block, which noise and
  /// the steps of the ranks move across a limit.
  double log_tolerance(double clipped) const {
    const double p = fraction_above(limit_e()), q = fraction_above(limit_e() / 4);
    const double relative_p = 1 / (blocks * p), relative_q = 1 / (blocks * q);
    const double excess = std::log(p / clipped) / exponent;
    return (relative_p + 1.1 * excess * (relative_p + relative_q) / std::log(4)) / exponent;
  }
  /// Returns the level that 90 % of the blocks exceed.
  double darkest_e() const {
    std::vector<double> sorted = signal_e;
    std::ranges::sort(sorted);
    return sorted[blocks / 10];
  }
};

TEST(BracketScene, ExtrapolatesThePowerLawOfTheLightBeyondSaturation) {
  InlineExecutor executor;
  std::mt19937_64 random(2614);
  for (int i = 0; i < 8; ++i) {
    const double min_e = std::uniform_real_distribution<>(5, 40)(random);  // one by one: in the same order everywhere
    const double exponent = std::uniform_real_distribution<>(0.5, 1)(random);
    const PowerLaw law(min_e, exponent, random());
    const Burst burst = law.burst();
    const double clipped = 0.002;
    const auto scene = measure_bracket_scene(burst.frame(0), burst.options(), clipped, executor);
    ASSERT_TRUE(scene) << scene.error().message;
    const double p = law.fraction_above(limit_e());
    EXPECT_NEAR(scene->saturated_fraction, p, 1.5 / blocks);
    const double expected = std::min(std::log(p / clipped) / law.exponent, std::log(max_highlight_fraction));
    EXPECT_NEAR(std::log(scene->highlight_fraction), expected, law.log_tolerance(clipped))
        << "exponent " << law.exponent;
    const double error_e = std::sqrt((law.darkest_e() + 4) / 128);
    const double spread_e = law.darkest_e() * 0.02 / law.exponent;  // levels of neighbouring ranks
    EXPECT_NEAR(scene->darkest_e, law.darkest_e(), 5 * error_e + spread_e);
    EXPECT_NEAR(scene->noise_variance_e2, 4, 0.05);
    EXPECT_NEAR(scene->saturation_e, limit_e(), 1);
  }
}

TEST(BracketScene, OfUnsaturatedFramesHasTheLevelThatTheFractionExceeds) {
  InlineExecutor executor;
  const PowerLaw law(20, 3, 1);
  const Burst burst = law.burst();
  const double brightest = std::ranges::max(law.signal_e);
  ASSERT_LT(brightest, limit_e());
  const auto scene = measure_bracket_scene(burst.frame(0), burst.options(), 1e-5, executor);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->saturated_fraction, 0);
  // The largest of 256 draws is within 2 to 5 standard deviations of their mean.
  EXPECT_GT(scene->highlight_fraction, brightest / limit_e());
  EXPECT_LT(scene->highlight_fraction, (brightest + 5 * std::sqrt(brightest + 4)) / limit_e());
}

TEST(BracketScene, OfBlackFramesHasTheLevelThatIsJustSignificantAndWithoutATimeIsRefused) {
  InlineExecutor executor;
  Burst burst;
  burst.scene = [](double, double, int) { return 0.0; };
  const auto black = measure_bracket_scene(burst.frame(0), burst.options(), 1e-5, executor);
  ASSERT_TRUE(black);
  EXPECT_TRUE(black->darkest_is_black);
  EXPECT_NEAR(black->darkest_e, 3 * std::sqrt((4 + 1.0 / 192) / 128), 0.01);
  burst = {};
  RawFrame frame = burst.frame(0);
  const auto found = measure_bracket_scene(frame, burst.options(), 1e-5, executor);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->darkest_is_black);
  frame.raw.info.exposure_s.reset();
  EXPECT_EQ(measure_bracket_scene(frame, burst.options(), 1e-5, executor).error().code, ErrorCode::insufficient);
}

/// Returns the values of a block away from its edges, where weights are those of other light, in electrons of the
/// scene.
std::vector<double> values_of(const MergedRaw& merged, double reference_light, int block) {
  double least_light = 1;
  for (const FrameUse& use : merged.frames) least_light = std::min(least_light, use.light);
  const double white_e = test::night_full_e() / least_light / reference_light;
  std::vector<double> out;
  for (int y = 3; y < block_px - 3; ++y) {
    for (int x = 3; x < block_px - 3; ++x) {
      out.push_back(Burst::signal_e(merged.frame, block_px * (block % blocks_along) + x,
                                    block_px * (block / blocks_along) + y, white_e));
    }
  }
  return out;
}

TEST(BracketScene, FramesTakenAsAdvisedReachThePredictedRatioAndHoldTheHighlights) {
  constexpr double clipped = 0.001, max_ratio_error = 0.02;  // the latter of measure_light_ratio
  InlineExecutor executor;
  std::mt19937_64 random(2615);
  int brackets = 0;
  for (int i = 0; i < 4; ++i) {
    const PowerLaw law(std::uniform_real_distribution<>(3, 12)(random),
                       std::uniform_real_distribution<>(0.5, 0.9)(random), random());
    Burst burst = law.burst();
    const auto scene = measure_bracket_scene(burst.frame(0), burst.options(), clipped, executor);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto advice = advise_bracket({.scene = *scene, .snr = 100, .longest_exposure_s = 10});
    ASSERT_TRUE(advice) << advice.error().message;
    brackets += advice->is_bracket() ? 1 : 0;
    std::vector<double> lights;  // the longest first: it is the reference
    for (const BracketExposure& e : advice->exposures) {
      lights.insert(lights.begin(), static_cast<std::size_t>(e.frames), e.exposure_s / scene->exposure_s);
    }
    burst.light = [lights](int index) { return lights[static_cast<std::size_t>(index)]; };
    const MergedRaw merged = burst.merged(static_cast<int>(lights.size()));
    double squares = 0, count = 0;
    for (int b = 0; b < blocks; ++b) {
      const double truth = law.signal_e[b], variance = truth * truth / merged_snr(*scene, advice->exposures, truth);
      if (truth > scene->highlight_fraction * limit_e()) continue;
      const std::vector<double> values = values_of(merged, lights.front(), b);
      const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
      EXPECT_NEAR(mean, truth, max_ratio_error * truth + 5 * std::sqrt(variance / static_cast<double>(values.size())));
      if (truth > 2 * law.darkest_e()) continue;
      for (const double value : values) squares += (value - truth) * (value - truth) / variance;
      count += static_cast<double>(values.size());
    }
    // Within the statistics of the squares, and 1 % for weights that are estimated from the noisy neighbours.
    EXPECT_NEAR(squares / count, 1, 5 * std::sqrt(2 / count) + 0.01) << i;
    EXPECT_LE(law.fraction_above(scene->highlight_fraction * limit_e() * std::exp(law.log_tolerance(clipped))),
              clipped + 1.0 / blocks);
  }
  EXPECT_GT(brackets, 0);
}

}  // namespace
}  // namespace lowlux::isp::bracket_scene_test
