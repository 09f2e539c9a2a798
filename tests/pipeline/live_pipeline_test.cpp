#include "isp/pipeline/live/live_pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/live_frames.h"

namespace lowlux::isp {
namespace {

using namespace live_testing;
using denoise_testing::flat;
using denoise_testing::waves;

struct Codes {
  std::vector<std::uint8_t> rgb;
  int width = 0;
};

Codes picture_of(LivePipeline& live) {
  const DevelopPlan& plan = live.decided();
  Codes out{std::vector<std::uint8_t>(static_cast<std::size_t>(3 * plan.width * plan.height)), plan.width};
  live.render(RowSink{[](void* context, int, int y, const std::uint8_t* rgb, int width) {
                        auto& codes = *static_cast<Codes*>(context);
                        std::copy_n(rgb, 3 * width, codes.rgb.data() + static_cast<std::ptrdiff_t>(3) * width * y);
                      },
                      &out});
  return out;
}

TEST(LivePipeline, DecidesAndRendersAsDevelopDoesOfTheSameFacts) {
  InlineExecutor one;
  const RawFrame frame = night(waves(150));
  for (const bool level : {false, true}) {
    DevelopOptions options;
    options.find_defects = false;
    options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
    options.denoise.level = denoise::Level::draft;
    options.denoise.line_noise = false;
    auto expected = plan_develop(frame, options, one);
    ASSERT_TRUE(expected) << expected.error().message;
    expected->noise_reduction.options.variance_scale.fill(1);  // live frames are not checked against their model
    LiveSetup setup = setup_of(frame);
    setup.max_demosaic = DemosaicMethod::residual_median;
    const auto live = live_of(setup, one);
    read(*live, frame);
    LiveFacts facts = known();
    if (level) facts.denoise = {.mode = LiveDenoise::Mode::level, .level = denoise::Level::draft};
    ASSERT_TRUE(live->plan(facts));
    const DevelopPlan& plan = live->decided();
    EXPECT_EQ(plan.levels.black.pedestal_dn, expected->levels.black.pedestal_dn);
    EXPECT_EQ(plan.levels.electrons_at_white.has_value(), level);
    EXPECT_EQ(expected->levels.electrons_at_white.has_value(), level);
    EXPECT_EQ(plan.rendering.neutral, expected->rendering.neutral);
    EXPECT_EQ(plan.rendering.white_gain, expected->rendering.white_gain);
    EXPECT_EQ(plan.rendering.exposure_ev, expected->rendering.exposure_ev);
    EXPECT_EQ(plan.rendering.exposure_rule, expected->rendering.exposure_rule);
    EXPECT_GT(plan.rendering.exposure_ev, 1);
    EXPECT_EQ(plan.rendering.transform.matrix, expected->rendering.transform.matrix);
    EXPECT_EQ(plan.rendering.tone.code8, expected->rendering.tone.code8);
    EXPECT_EQ(plan.from_codes, !level);
    for (int c = 0; level && c < 3; ++c) {
      const auto& noise = plan.noise_reduction.noise;
      EXPECT_NEAR(noise.variance_e2[c], expected->noise_reduction.noise.variance_e2[c], 1e-9);  // orders of sums
      EXPECT_NEAR(noise.saturation_e[c], expected->noise_reduction.noise.saturation_e[c], 1e-9);
    }
    Picture picture = make_picture(*expected);
    Pipeline(one).render(frame, *expected, picture);
    const Plane<std::uint8_t>& codes = std::get<Encoded8>(picture).codes;
    const Codes found = picture_of(*live);
    EXPECT_TRUE(std::equal(found.rgb.begin(), found.rgb.end(), codes.data())) << "level: " << level;
  }
}

TEST(LivePipeline, GivesTheSameBytesForEveryNumberOfThreads) {
  std::vector<Codes> first;
  for (const int threads : {1, 2, 3}) {
    PoolExecutor executor(threads);
    LiveSetup setup = setup_of(night(flat(1, 1, 1)));
    setup.temporal = true;
    const auto live = live_of(setup, executor);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const RawFrame frame = night(waves(20), seed);
      read(*live, frame);
      LiveFacts facts;  // all of it from the frame
      facts.black_dn = known().black_dn;
      ASSERT_TRUE(live->plan(facts));
      const Codes found = picture_of(*live);
      if (threads == 1) first.push_back(found);
      EXPECT_EQ(found.rgb, first[seed - 1].rgb) << threads << " threads, frame " << seed;
    }
  }
}

TEST(LivePipeline, MonochromeFramesMakeGreyPictures) {
  InlineExecutor one;
  const RawFrame frame = night(waves(150));
  LiveSetup setup = setup_of(frame);
  setup.format.layout = SensorLayout::monochrome;
  setup.format.phase = BayerPhase::rggb;
  setup.colour = {};
  setup.temporal = true;
  const auto live = live_of(setup, one);
  read(*live, frame);
  LiveFacts facts = known();
  facts.neutral.reset();
  facts.denoise.mode = LiveDenoise::Mode::automatic;
  ASSERT_TRUE(live->plan(facts));
  EXPECT_FALSE(live->decided().noise_reduction.reduces());
  const Codes codes = picture_of(*live);
  for (std::size_t i = 0; i < codes.rgb.size(); i += 3) {
    ASSERT_EQ(codes.rgb[i], codes.rgb[i + 1]);
    ASSERT_EQ(codes.rgb[i], codes.rgb[i + 2]);
  }
  EXPECT_GT(*std::ranges::max_element(codes.rgb), 100);
}

struct Moments {
  double mean_e = 0;
  double variance_e2 = 0;
};
Moments moments_of(LivePipeline& live) {
  const Rect& active = live.frame().raw.active;
  Plane<std::uint16_t> codes(active.width, active.height);
  live.render_mosaic(codes.view());
  const auto n = static_cast<double>(codes.size());
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double e = (codes.data()[i] / 4.0 - test::night_black_dn) / test::night_gain_dn_per_e;
    sum += e, square += e * e;
  }
  return {sum / n, square / n - sum / n * sum / n};
}

TEST(LivePipeline, WhatFramesBeforeTellIsScaledToTheExposure) {
  InlineExecutor one;
  LiveSetup setup = setup_of(night(flat(1, 1, 1)));
  setup.temporal = true;
  const auto live = live_of(setup, one);
  LiveFacts facts = known();
  for (std::uint64_t seed = 1; seed <= 9; ++seed) {
    const double light = seed < 9 ? 1 : 0.5;  // the last at half the time
    const RawFrame frame = night(flat(100 * light, 100 * light, 100 * light), seed);
    facts.exposure_s = 0.04 * light;
    read(*live, frame);
    ASSERT_TRUE(live->plan(facts));
    const Moments found = moments_of(*live);
    EXPECT_LT(seed == 1 ? 0 : live->moved(), 0.05);
    if (seed < 9) continue;
    // Of 8 frames the mean has 104 / 8 e-^2, in half the light a quarter of that; a frame has 54 e-^2.
    const double before_e2 = 104.0 / 8 / 4, variance_e2 = 1 / (1 / before_e2 + 1 / 54.0);
    const auto n = static_cast<double>(frame.raw.dn.size());
    EXPECT_NEAR(found.mean_e, 50, 5 * std::sqrt(variance_e2 / n));
    EXPECT_NEAR(found.variance_e2, variance_e2, 0.3 * variance_e2);  // blocks that moved by chance start anew
  }
}

TEST(LivePipeline, SetupsThatCannotBeAreRefused) {
  InlineExecutor one;
  const LiveSetup good = setup_of(night(flat(1, 1, 1)));
  const auto code_of = [&](const auto& change) {
    LiveSetup setup = good;
    change(setup);
    const auto live = LivePipeline::make(setup, one);
    EXPECT_FALSE(live);
    return live ? ErrorCode::exists : live.error().code;
  };
  EXPECT_EQ(code_of([](LiveSetup& s) { s.format.bits = 11; }), ErrorCode::unsupported);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.width = 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.height = 65537; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.active.x = 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.active = {2147483647, 0, 2, 2}; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.active.height = 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.masked = {{-1, 0, 2, 2}}; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.white_dn = std::nan(""); }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.white_dn = 1e-317; }), ErrorCode::invalid_argument);  // its square is 0
  EXPECT_EQ(code_of([](LiveSetup& s) { s.most = denoise::Level::best; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.samples = SampleType::f32; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of([](LiveSetup& s) { s.look.look = Look::model; }), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lowlux::isp
