#include "isp/pipeline/budget/step_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/budget/step_candidates.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/plan/plan_regions.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::flat;
using test::one_thread;

DevelopOptions planned_options(std::optional<double> tolerance, std::optional<double> budget_s = {}) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace().tolerance_delta_e = tolerance;
  options.effects->budget_s = budget_s;
  options.effects->cost = test::reference_cost();
  return options;
}

/// A grey of so many electrons of green.
RawFrame grey(double green_e, int width = 320, int height = 256) {
  return test::night_frame(Camera{}, flat(0.5 * green_e, green_e, 0.625 * green_e), width, height);
}

StepPlan effects_of(const RawFrame& frame, const DevelopOptions& options) {
  const auto plan = plan_develop(frame, options, one_thread);
  EXPECT_TRUE(plan) << (plan ? "" : plan.error().message);
  return plan ? *plan->effects : StepPlan{};
}

const PlannedStep& named(const StepPlan& plan, std::string_view name) {
  return *std::ranges::find(plan.effects, name, &PlannedStep::name);
}

TEST(VisibleNoise, PercentileIsThatOfNormalDifferences) {
  EXPECT_EQ(visible_percentile({}), 0);
  const std::vector<float> none(10, 0.0f), equal(10, 2.0f);
  EXPECT_EQ(visible_percentile(none), 0);
  // 95 % of a normal law lie within so many deviations; half of ten after 24 bisections is 3e-7.
  EXPECT_NEAR(visible_percentile(equal), 2 * 1.9599639845, 1e-6);
  std::vector<float> few(100, 0.0f);
  few[0] = few[1] = 50;
  EXPECT_EQ(visible_percentile(few), 0) << "what two blocks of a hundred differ by is above the percentile";
}

// An even grey's means over 8 x 8 pixels, by the noise alone: the prediction against frames that were developed.
TEST(VisibleNoise, OfAGreyIsWhatFramesDifferBy) {
  const RawFrame frame = grey(400);
  DevelopOptions options = planned_options(0.5);
  const auto plan = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(plan);
  const Thumbnail thumbnail = make_thumbnail(frame, plan->levels.black, one_thread);
  denoise::RawNoise noise = plan->noise_reduction.noise;
  DevelopPlan with_electrons = *plan_develop(
      frame,
      [&] {
        options.denoise = {DenoiseChoice::Mode::level, Level::draft};
        return options;
      }(),
      one_thread);
  noise = with_electrons.noise_reduction.noise;
  const auto blocks = visibility_blocks(frame, with_electrons.options, with_electrons.levels, with_electrons.rendering,
                                        noise, thumbnail, one_thread);
  ASSERT_FALSE(blocks.empty());
  for (const VisibilityBlock& block : blocks) {
    EXPECT_NEAR(block.snr, 17, 1.5);  // mean of 200, 400, 400 and 250 e-, its noise and that of readout
    EXPECT_GT(block.noise_delta_e, 0.3f);
    EXPECT_LT(block.noise_delta_e, 3.0f);
    EXPECT_EQ(block.dark_delta_e, 0);
  }
}

std::vector<VisibilityBlock> visibility_blocks(const RawFrame& frame, const DevelopPlan& plan,
                                               const Thumbnail& thumbnail) {
  return visibility_blocks(frame, plan.options, plan.levels, plan.rendering, plan.noise_reduction.noise, thumbnail,
                           one_thread);
}

DevelopPlan exposed(const RawFrame& frame, double ev) {
  DevelopOptions options = planned_options(0.5);
  options.denoise = {DenoiseChoice::Mode::level, Level::draft};
  options.exposure_ev = ev;
  return *plan_develop(frame, options, one_thread);
}

// Thresholds go by the mean variance of the surroundings: beside a lamp they are higher.
TEST(VisibleNoise, SurroundingsAreBrighterBesideALamp) {
  RawFrame frame = grey(20);
  const int middle = frame.raw.dn.width() / 2;
  for (int y = 0; y < frame.raw.dn.height(); ++y) {
    for (int x = middle; x < frame.raw.dn.width(); ++x) frame.raw.dn.at(x, y) = 3500;
  }
  const DevelopPlan plan = exposed(frame, 0);
  const Thumbnail thumbnail = make_thumbnail(frame, plan.levels.black, one_thread);
  const auto blocks = visibility_blocks(frame, plan, thumbnail);
  int beside = 0;
  for (const VisibilityBlock& block : blocks) {
    const double away_px = (0.5 - static_cast<double>(block.x)) * frame.raw.active.width;
    if (away_px > 24 || away_px < 0) {
      EXPECT_NEAR(block.surroundings, 1, 0.1) << away_px;
    } else if (away_px < 12) {
      EXPECT_EQ(block.surroundings, 2) << away_px;
      ++beside;
    }
    EXPECT_FLOAT_EQ(residual_delta_e(Level::draft, block),
                    static_cast<float>(residual_noise_fraction(Level::draft, static_cast<double>(block.snr))) *
                        block.surroundings * block.noise_delta_e);
  }
  EXPECT_GT(beside, 0);
}

// Pixels of one electron with noise of several are clipped often, those of a hundred never.
TEST(VisibleNoise, ClippingAtBlackIsSeenInTheDark) {
  for (const auto& [green_e, seen] : {std::pair{1.0, true}, std::pair{400.0, false}}) {
    const RawFrame frame = grey(green_e);
    const DevelopPlan plan = exposed(frame, 5);
    const Thumbnail thumbnail = make_thumbnail(frame, plan.levels.black, one_thread);
    for (const VisibilityBlock& block : visibility_blocks(frame, plan, thumbnail)) {
      if (seen) {
        EXPECT_GT(block.clip_delta_e, 0.02f);
        EXPECT_GT(residual_delta_e(std::nullopt, block), block.clip_delta_e);
      } else {
        EXPECT_LT(block.clip_delta_e, 1e-3f);
      }
    }
  }
}

/// Left of an edge one grey, right of it another [e- of green].
RawFrame two_greys(double left_e, double right_e, int edge_px, int width, int height) {
  RawFrame out = grey(right_e, width, height);
  const RawFrame left = grey(left_e, width, height);
  for (int y = 0; y < height; ++y) std::copy_n(left.raw.dn.row(y), edge_px, out.raw.dn.row(y));
  return out;
}

void expect_work(const RawFrame& frame, std::array<double, 3> start, std::array<double, 3> work) {
  const DevelopPlan plan = exposed(frame, 0);
  const Thumbnail thumbnail = make_thumbnail(frame, plan.levels.black, one_thread);
  const ChromaWork found = chroma_work(frame, plan.levels, plan.noise_reduction.noise, thumbnail);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(found.start[i], start[i], 1e-12) << "level " << i;
    EXPECT_NEAR(found.work[i], work[i], 1e-12) << "level " << i;
  }
}

// Tiles are 128 px wide, and chroma is worked on for tiles up to two away. Camera's pixels have a signal to noise ratio
// of 3 at some 20 electrons, of 0.7 at some 3.
TEST(ChromaWork, ReachesTwoTilesBeyondWhatStartsFine) {
  expect_work(two_greys(300, 300, 0, 1280, 128), {1, 0, 0}, {1, 0, 0});
  expect_work(two_greys(0.01, 0.01, 0, 1280, 128), {0, 0, 1}, {0, 0, 1});
  expect_work(two_greys(300, 0.01, 128, 1280, 128), {0.1, 0, 0.9}, {0.3, 0, 0.7});
  expect_work(two_greys(5, 0.01, 256, 1280, 128), {0, 0.2, 0.8}, {0, 0.4, 0.6});
  expect_work(two_greys(300, 5, 384, 1280, 256), {0.3, 0.7, 0}, {0.5, 0.5, 0});
  expect_work(two_greys(300, 0.01, 64, 100, 90), {1, 0, 0}, {1, 0, 0});                // one tile
  expect_work(two_greys(300, 0.01, 256, 800, 100), {0.32, 0, 0.68}, {0.64, 0, 0.36});  // the last one is larger
}

// A lamp that fills a block does not make the mean of its tile bright.
TEST(ChromaWork, IsBasedOnTheMeansOfTiles) {
  RawFrame frame = two_greys(300, 0.01, 8, 1280, 128);
  const int dark = frame.raw.dn.at(1000, 100);
  for (int y = 8; y < 128; ++y) std::fill_n(frame.raw.dn.row(y), 8, static_cast<std::uint16_t>(dark));
  expect_work(frame, {0, 0, 1}, {0, 0, 1});
}

TEST(PlanEffects, LevelsLeaveLessTheMoreTheyWork) {
  for (const double snr : {0.0, 1.0, 5.0, 10.0, 100.0}) {
    EXPECT_GT(residual_noise_fraction(std::nullopt, snr), residual_noise_fraction(Level::draft, snr));
    EXPECT_GT(residual_noise_fraction(Level::draft, snr), residual_noise_fraction(Level::standard, snr));
    EXPECT_GT(residual_noise_fraction(Level::standard, snr), residual_noise_fraction(Level::high, snr));
    EXPECT_EQ(residual_noise_fraction(Level::high, snr), 0);
  }
  EXPECT_GT(error_fraction(std::nullopt), error_fraction(Level::draft));
  EXPECT_GT(error_fraction(Level::high), error_fraction(Level::best));
}

TEST(PlanEffects, MoreLightCallsForLessWork) {
  std::optional<Level> before = Level::high;
  for (const double green_e : {4.0, 40.0, 400.0, 3000.0}) {
    const StepPlan plan = effects_of(grey(green_e), planned_options(0.5));
    EXPECT_LE(plan.level, before) << green_e;
    before = plan.level;
  }
  EXPECT_EQ(effects_of(grey(4), planned_options(0.5)).level, Level::high);
  EXPECT_EQ(effects_of(grey(3000), planned_options(2)).level, std::nullopt);
  EXPECT_EQ(effects_of(grey(4), planned_options(50)).level, std::nullopt) << "a tolerance above all there is";
}

TEST(PlanEffects, AllIsAllAndGivenLevelsStay) {
  DevelopOptions options = planned_options(50);
  options.effects->all = true;
  EXPECT_EQ(effects_of(grey(3000), options).level, Level::high);
  options = planned_options(50);
  options.denoise = {DenoiseChoice::Mode::level, Level::draft};
  EXPECT_EQ(effects_of(grey(4), options).level, Level::draft);
  options.denoise.mode = DenoiseChoice::Mode::off;
  const auto plan = plan_develop(grey(4), options, one_thread);
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->noise_reduction.reduces());
}

TEST(PlanEffects, ABudgetTakesTheMostAccuratePlanThatFits) {
  const RawFrame frame = grey(20);
  double before = 0;
  std::optional<Level> level_before;
  for (const double budget_ms : {12.0, 14.0, 18.0, 30.0, 1e4}) {
    const StepPlan plan = effects_of(frame, planned_options(std::nullopt, 1e-3 * budget_ms));
    ASSERT_TRUE(plan.predicted_s);
    EXPECT_LE(*plan.predicted_s, 1e-3 * budget_ms);
    EXPECT_GE(plan.level, level_before);
    EXPECT_GE(*plan.predicted_s, before);
    before = *plan.predicted_s;
    level_before = plan.level;
  }
  EXPECT_EQ(level_before, Level::best);
  const StepPlan both = effects_of(frame, planned_options(50, 10));
  EXPECT_EQ(both.level, std::nullopt) << "with a tolerance the cheapest plan within it";
}

TEST(PlanEffects, ABudgetLeavesOutDemosaicingByResidualsOnlyWhereItMust) {
  const RawFrame frame = grey(2000);
  const auto planned = [&](double budget_s) {
    return plan_develop(frame, planned_options(std::nullopt, budget_s), one_thread);
  };
  const auto ample = planned(10);
  ASSERT_TRUE(ample);
  EXPECT_EQ(ample->demosaic.demosaic.method, DemosaicMethod::residual);
  const double min_s =
      predicted_s(*test::reference_cost(), cost_size(320, 256),
                  {{CostPart::planning}, {CostPart::defects}, {CostPart::codes}, {CostPart::encoded_malvar}});
  const auto tight = planned(1.01 * min_s);
  ASSERT_TRUE(tight);
  EXPECT_EQ(tight->demosaic.demosaic.method, DemosaicMethod::encoded_malvar);
  EXPECT_FALSE(named(*tight->effects, "demosaicing by residuals").used);
  EXPECT_GT(named(*ample->effects, "demosaicing by residuals").seconds, 0);
  DevelopOptions fixed = planned_options(std::nullopt, 10);
  fixed.demosaic = DemosaicMethod::malvar;
  const auto given = plan_develop(frame, fixed, one_thread);
  ASSERT_TRUE(given);
  EXPECT_EQ(given->demosaic.demosaic.method, DemosaicMethod::malvar);
  EXPECT_EQ(given->demosaic.reason, "given");
}

TEST(PlanEffects, ABudgetBelowTheCheapestPlanIsRefusedWithItsTime) {
  const auto refused = plan_develop(grey(20), planned_options(std::nullopt, 1e-6), one_thread);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::insufficient);
  const double cheapest_s =
      predicted_s(*test::reference_cost(), cost_size(320, 256),
                  {{CostPart::planning}, {CostPart::defects}, {CostPart::codes}, {CostPart::encoded_malvar}});
  EXPECT_NE(refused.error().message.find("cheapest plan"), std::string::npos) << refused.error().message;
  const double stated_ms =
      std::strtod(refused.error().message.c_str() + refused.error().message.find("take ") + 5, nullptr);
  EXPECT_NEAR(stated_ms, 1e3 * cheapest_s, 0.5 * 1e3 * cheapest_s) << refused.error().message;
}

// Dark charge that a profile knows: half of the signal changes the picture, a thousandth does not.
TEST(PlanEffects, DarkChargeIsLeftInWhereItCannotBeSeen) {
  const RawFrame frame = grey(2000);
  DevelopOptions options = planned_options(2);
  options.black.choice = BlackChoice::measured;
  options.black.measured.emplace().pedestal_dn.fill(test::night_black_dn);
  options.black.measured->dark_mean_e.fill(500);
  const StepPlan large = effects_of(frame, options);
  EXPECT_TRUE(large.dark);
  EXPECT_GT(named(large, "dark charge").size, 2);
  options.black.measured->dark_mean_e.fill(1);
  const auto small = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->effects->dark);
  EXPECT_EQ(small->levels.black.dark_mean_e, PerSite<double>{});
}

// Known dark charge is not light: it must not darken the image. The exposure counts from a white of less light.
TEST(PlanEffects, DarkChargeDoesNotCountForTheExposure) {
  DevelopOptions options;
  options.black.choice = BlackChoice::measured;
  options.black.measured.emplace().pedestal_dn.fill(test::night_black_dn);
  const auto with = [&](double signal_e, double dark_e) {
    options.black.measured->dark_mean_e.fill(dark_e);
    Camera camera;
    camera.dark_e.fill(dark_e);
    const RawFrame frame = test::night_frame(camera, flat(0.5 * signal_e, signal_e, 0.625 * signal_e), 256, 256);
    return plan_develop(frame, options, one_thread)->rendering.exposure_ev;
  };
  EXPECT_NEAR(with(300, 300) - std::log2(1 - 300 / test::night_full_e()), with(300, 0), 0.05);
}

TEST(FrameSample, LargeFramesAreSampledAtEvenPlacesAndSmallOnesWhole) {
  const RawFrame small = grey(40);
  const auto plan = plan_develop(small, {}, one_thread);
  ASSERT_TRUE(plan);
  EXPECT_TRUE(sample_squares(small, plan->levels).empty());
  RawFrame large;
  large.raw.active = {3, 5, 4001, 3001};
  const auto squares = sample_squares(large, plan->levels);
  ASSERT_EQ(squares.size(), 6);
  for (const Rect& square : squares) {
    EXPECT_EQ(square.x % 2, 0);
    EXPECT_EQ(square.y % 2, 0);
    EXPECT_GE(square.x, 0);
    EXPECT_LE(square.x + square.width, 4001);
    EXPECT_LE(square.y + square.height, 3001);
  }
  EXPECT_EQ(squares.back().x, (4001 - 512) & ~1);
}

std::vector<VisibilityBlock> blocks_of(double residual_delta_e, double right_delta_e) {
  std::vector<VisibilityBlock> out;
  for (int i = 0; i < 400; ++i) {
    const int column = i % 20, row = i / 20;
    const float x = (static_cast<float>(column) + 0.5f) / 20;
    out.push_back({.x = x,
                   .y = (static_cast<float>(row) + 0.5f) / 20,
                   .snr = 10,
                   .noise_delta_e = static_cast<float>(x < 0.5f ? residual_delta_e : right_delta_e)});
  }
  return out;
}

TEST(PlanRegions, BrightHalvesAreLeftAndDarkOnesGetTheLevel) {
  const Rect active{0, 0, 8192, 6144};
  const auto regions = plan_regions(active, blocks_of(0.05, 5), Level::high, 0.5);
  ASSERT_TRUE(regions);
  EXPECT_EQ(regions->columns, 8);
  EXPECT_EQ(regions->rows, 6);
  for (int i = 0; i < 48; ++i) {
    EXPECT_EQ(regions->level[static_cast<std::size_t>(i)], i % 8 < 4 ? std::nullopt : std::optional(Level::high));
  }
  EXPECT_FALSE(plan_regions(active, blocks_of(5, 5), Level::high, 0.5)) << "nothing to save";
  EXPECT_FALSE(plan_regions({0, 0, 900, 900}, blocks_of(0.05, 5), Level::high, 0.5)) << "one region";
}

}  // namespace
}  // namespace lowlux::isp
