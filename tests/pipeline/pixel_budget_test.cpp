// Time budgets of frames that are not mosaics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "isp/pipeline/plan/plan_develop.h"
#include "tests/denoise/frames.h"
#include "tests/pipeline/pixel_frames.h"
#include "tests/support/executors.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp::pixel_budget_test {
namespace {

using denoise::Level;
using denoise_testing::flat;
using pixel_testing::at;
using pixel_testing::layouts;
using pixel_testing::pixel_frame;
using test::one_thread;

DevelopOptions options_of(std::optional<double> budget_s, const DenoiseChoice& choice) {
  DevelopOptions options;
  options.denoise = choice;
  options.effects.emplace();
  options.effects->budget_s = budget_s;
  options.effects->cost = test::reference_cost();
  if (budget_s) options.effects->tolerance_delta_e.reset();
  return options;
}

constexpr DenoiseChoice automatic{.mode = DenoiseChoice::Mode::automatic};

DevelopPlan planned(const RawFrame& frame, const DevelopOptions& options) {
  Result<DevelopPlan> plan = plan_develop(frame, options, one_thread);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

TEST(PixelBudgets, MoreTimeNeverMeansALowerLevel) {
  const auto seed = static_cast<std::uint32_t>(std::random_device{}());
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 6; ++i) {
    const int width = static_cast<int>(std::exp(6 * uniform(draw))),
              height = static_cast<int>(std::exp(6 * uniform(draw)));
    const double mean_e = std::exp(7 * uniform(draw));
    for (const SensorLayout layout : layouts) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(width) + " x " + std::to_string(height));
      const RawFrame frame = pixel_frame(layout, flat(mean_e, mean_e, mean_e), width, height, seed);
      const auto refused = plan_develop(frame, options_of(1e-12, automatic), one_thread);
      ASSERT_FALSE(refused);
      EXPECT_NE(refused.error().message.find("cheapest plan"), std::string::npos);
      const double none_s = *planned(frame, options_of(100, {})).effects->predicted_s;
      std::optional<Level> before;
      for (const double factor : {1.01, 3.0, 10.0, 20.0, 50.0, 1e5}) {
        const DevelopPlan plan = planned(frame, options_of(factor * none_s, automatic));
        EXPECT_LE(*plan.effects->predicted_s, factor * none_s);
        EXPECT_GE(plan.noise_reduction.level, before);
        EXPECT_EQ(plan.effects->level, plan.noise_reduction.level);
        before = plan.noise_reduction.level;
      }
      EXPECT_EQ(before, Level::best);
    }
  }
}

// Levels differ by what they differ by for the mosaic of all sites, whose time is most of theirs.
TEST(PixelBudgets, LevelsTakeWhatTheyTakeForFourTimesAsManySites) {
  for (const SensorLayout layout : layouts) {
    const RawFrame frame = pixel_frame(layout, flat(200, 200, 200), 320, 240, 1);
    const auto all_but_sites_s = [&](Level level, CostPart part) {
      const DevelopPlan plan = planned(frame, options_of(100, at(level)));
      EXPECT_EQ(plan.noise_reduction.level, level);
      const double of_sites_s = predicted_s(*test::reference_cost(), cost_size(640, 480), {{part}});
      EXPECT_GT(*plan.effects->predicted_s, 0.7 * of_sites_s);
      EXPECT_LT(*plan.effects->predicted_s, 1.8 * of_sites_s);
      return *plan.effects->predicted_s - of_sites_s;
    };
    const double draft_s = all_but_sites_s(Level::draft, CostPart::draft_0);
    EXPECT_NEAR(all_but_sites_s(Level::standard, CostPart::standard_0), draft_s, 1e-9);
    EXPECT_NEAR(all_but_sites_s(Level::high, CostPart::high_0), draft_s, 1e-9);
    EXPECT_NEAR(all_but_sites_s(Level::best, CostPart::best_0), draft_s, 1e-9);
  }
}

TEST(PixelBudgets, WithoutABudgetTheLevelOfTheSignalToNoiseRatioIsCounted) {
  for (const SensorLayout layout : layouts) {
    const RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 96, 64, 1);
    const DevelopPlan plan = planned(frame, options_of({}, automatic)), off = planned(frame, options_of({}, {}));
    EXPECT_EQ(plan.noise_reduction.level, Level::standard);
    EXPECT_EQ(plan.effects->level, Level::standard);
    EXPECT_NE(plan.noise_reduction.reason.find("signal-to-noise ratio"), std::string::npos);
    EXPECT_GT(*plan.effects->predicted_s, *off.effects->predicted_s);
    DevelopOptions everything = options_of({}, automatic);
    everything.effects->all = true;
    EXPECT_EQ(planned(frame, everything).noise_reduction.level, Level::high);
  }
}

// One tile of 1000 x 800 pixels is a mosaic of 2000 x 1600 sites; larger frames overlap by their margins.
TEST(PixelBudgets, SizesAreThoseOfCells) {
  RawDn raw;
  raw.layout = SensorLayout::linear_rgb;
  raw.active = raw.default_crop = {0, 0, 1000, 800};
  EXPECT_DOUBLE_EQ(cost_size(raw).megapixels, 0.8);
  EXPECT_DOUBLE_EQ(cost_size(raw).denoised_megapixels, cost_size(2000, 1600).denoised_megapixels);
  raw.active = raw.default_crop = {0, 0, 3120, 2080};
  EXPECT_GT(cost_size(raw).denoised_megapixels, 1.4 * cost_size(6240, 4160).denoised_megapixels);
  EXPECT_LT(cost_size(raw).denoised_megapixels, 1.7 * cost_size(6240, 4160).denoised_megapixels);
}

// A monochrome value moves all channels at once: the noise of a grey is one of lightness, of a mean of 64 values.
TEST(PixelBudgets, TheVisibleNoiseIsThatOfAllSamples) {
  const auto noise_of = [](SensorLayout layout) {
    const RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 96, 64, 1);
    return planned(frame, options_of({}, automatic)).effects->effects.front().size;
  };
  const double colours = noise_of(SensorLayout::linear_rgb), grey = noise_of(SensorLayout::monochrome);
  EXPECT_GT(colours, 0);
  EXPECT_GT(grey, 0);
  EXPECT_LT(grey, colours) << "without chroma";
}

}  // namespace
}  // namespace lowlux::isp::pixel_budget_test
