#include <gtest/gtest.h>

#include <cstring>

#include "calib/profile/profile_io.h"
#include "isp/adapter/stage_profile.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::stage_test {
namespace {

using namespace stage_testing;

constexpr int width = 200, height = 148;

CameraProfile coloured_profile() {
  CameraProfile profile;
  profile.mosaic = "GRBG";
  for (const auto& [cct_k, red] : {std::pair{2856.0, 0.9}, {6504.0, 0.7}}) {
    ColourProfile colour;
    colour.illuminant = "a light";
    colour.calibration.cct_k = cct_k;
    colour.calibration.xyz_to_camera = {{{red, -0.2, -0.1}, {-0.4, 1.2, 0.2}, {-0.1, 0.2, 0.6}}};
    profile.colours.push_back(colour);
  }
  return profile;
}

/// The same frame as a file would give it, with the noise of the parameters.
RawFrame raw_frame(const RawFormat& format, const Codes& codes, const lowlux_stage_params& params) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(width, height);
  std::copy(codes.begin(), codes.end(), raw.dn.data());
  raw.phase = format.phase;
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.masked_is_stated = true;
  raw.white_dn.fill(largest_code(format));
  frame.colour.calibrations = isp::StageProfile::of(coloured_profile())->calibrations();
  frame.colour.as_shot_neutral = Vector3{1.0 / params.colour_gains[0], 1, 1.0 / params.colour_gains[1]};
  const double range = raw.white_dn[0] - params.black_level[0], gain = params.noise_gain, read = params.noise_read;
  frame.noise.emplace();
  frame.noise->scale.fill(gain / range);
  frame.noise->offset.fill((read * read + 1.0 / 12) / (range * range));
  return frame;
}

struct Way {
  std::int32_t denoise;
  isp::DenoiseChoice choice;
  bool automatic;  // exposure and white
};

/// The picture that `lowlux develop` makes where it is asked for the same. What it measures of noise beyond the model
/// (lines, its scale) live frames do not.
std::vector<std::uint8_t> developed(const RawFrame& frame, const Way& way, const lowlux_stage_params& params) {
  isp::DevelopOptions options;
  options.black = {.choice = isp::BlackChoice::given, .given_dn = {}};
  options.black.given_dn.fill(params.black_level[0]);
  options.find_defects = false;
  options.denoise = way.choice;
  options.denoise.line_noise = false;
  if (way.automatic) {
    options.white_balance.mode = isp::WhiteBalanceChoice::Mode::automatic;
  } else {
    options.exposure_ev = params.exposure_ev;
  }
  PoolExecutor executor(2);
  Result<isp::DevelopPlan> plan = isp::plan_develop(frame, options, executor);
  EXPECT_TRUE(plan) << plan.error().message;
  plan->noise_reduction.options.variance_scale.fill(1);
  isp::Pipeline pipeline(executor);
  Picture picture = isp::make_picture(*plan);
  pipeline.render(frame, *plan, picture);
  const Plane<std::uint8_t>& rgb = std::get<Encoded8>(picture).codes;
  return {rgb.data(), rgb.data() + rgb.size()};
}

TEST(Stage, DevelopsAFirstFrameAsFilesAreDeveloped) {
  const test::ScratchDirectory scratch;
  scratch.write("colours.json", *calib::profile_text(coloured_profile()));
  const std::string file = scratch.file("colours.json");
  auto settings = plain_settings(3);
  settings.profile_file = file.c_str();
  settings.most_denoise = LOWLUX_STAGE_LEVEL_HIGH;
  settings.demosaic = LOWLUX_STAGE_DEMOSAIC_RESIDUAL_MEDIAN;
  using Mode = isp::DenoiseChoice::Mode;
  const RawFormatNames& names = names_of_bayer(12, BayerPhase::grbg);
  const Codes codes = scene(names.format, width, height);
  for (const bool automatic : {false, true}) {
    for (const Way& way : {Way{LOWLUX_STAGE_DENOISE_OFF, {Mode::off}, automatic},
                           Way{LOWLUX_STAGE_DENOISE_FAST, {Mode::level, denoise::Level::draft}, automatic},
                           Way{LOWLUX_STAGE_DENOISE_HIGH_QUALITY, {Mode::level, denoise::Level::high}, automatic},
                           Way{LOWLUX_STAGE_DENOISE_AUTO, {Mode::automatic}, automatic}}) {
      Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
      ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << rig.error();
      auto params = fixed_params(names.format);
      params.denoise = way.denoise;
      if (automatic) params.valid &= ~(LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_EXPOSURE_VALUE);
      ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
      const auto expected = developed(raw_frame(names.format, codes, params), way, params);
      EXPECT_EQ(rig.result.level == 0, way.denoise == LOWLUX_STAGE_DENOISE_OFF);
      std::size_t differ = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) differ += rig.planes[0][i] != expected[i] ? 1 : 0;
      EXPECT_EQ(differ, 0U) << "denoise " << way.denoise << (automatic ? " automatic" : " given");
    }
  }
}

/// Of the most that takes part: frames before, levels by the frame, exposure and white of the frame's own.
lowlux_stage_settings everything() {
  auto out = plain_settings(2);
  out.most_denoise = LOWLUX_STAGE_LEVEL_HIGH;
  out.temporal = 1;
  return out;
}

lowlux_stage_params numbered(const RawFormat& format, std::uint32_t sequence) {
  auto out = fixed_params(format);
  out.valid |= LOWLUX_STAGE_HAS_SEQUENCE;
  out.denoise = LOWLUX_STAGE_DENOISE_FAST;
  out.sequence = sequence;
  return out;
}

TEST(Stage, AfterAGapOrAStepBackStartsLikeAFreshOne) {
  const RawFormatNames& names = names_of_bayer(10);
  const auto frame = [&](std::uint32_t seed) { return scene(names.format, width, height, seed); };
  const std::uint64_t second = 1'000'000'000;
  struct Step {
    std::uint32_t sequence;
    std::uint64_t timestamp_ns;
    bool follows;
  };
  for (const Step& step : {Step{8, 3 * second, true}, Step{9, 3 * second, false}, Step{7, 3 * second, false},
                           Step{6, 3 * second, false}, Step{0, 3 * second, false}, Step{8, 5 * second, true},
                           Step{8, 5 * second + 1, false}, Step{8, 3 * second - 1, false}}) {
    Rig rig(everything(), names, width, height, LOWLUX_STAGE_BAYER16),
        fresh(everything(), names, width, height, LOWLUX_STAGE_BAYER16);
    for (std::uint32_t i = 5; i <= 7; ++i) {
      auto params = numbered(names.format, i);
      params.valid |= LOWLUX_STAGE_HAS_TIMESTAMP;
      params.timestamp_ns = 3 * second;
      ASSERT_EQ(rig.process(frame(i), params), LOWLUX_STAGE_OK) << rig.error();
    }
    auto params = numbered(names.format, step.sequence);
    params.valid |= LOWLUX_STAGE_HAS_TIMESTAMP;
    params.timestamp_ns = step.timestamp_ns;
    ASSERT_EQ(rig.process(frame(9), params), LOWLUX_STAGE_OK);
    ASSERT_EQ(fresh.process(frame(9), params), LOWLUX_STAGE_OK);
    EXPECT_EQ(rig.planes != fresh.planes, step.follows) << step.sequence << ' ' << step.timestamp_ns;
  }
}

TEST(Stage, CountsSequencesAcross2To32) {
  const RawFormatNames& names = names_of_bayer(10);
  Rig rig(everything(), names, width, height, LOWLUX_STAGE_BAYER16),
      fresh(everything(), names, width, height, LOWLUX_STAGE_BAYER16);
  const Codes first = scene(names.format, width, height, 1), second = scene(names.format, width, height, 2);
  ASSERT_EQ(rig.process(first, numbered(names.format, UINT32_MAX)), LOWLUX_STAGE_OK);
  ASSERT_EQ(rig.process(second, numbered(names.format, 0)), LOWLUX_STAGE_OK);
  ASSERT_EQ(fresh.process(second, numbered(names.format, 0)), LOWLUX_STAGE_OK);
  EXPECT_NE(rig.planes, fresh.planes);
}

TEST(Stage, TakesARefusedFrameForAGap) {
  const RawFormatNames& names = names_of_bayer(10);
  Rig rig(everything(), names, width, height, LOWLUX_STAGE_BAYER16),
      fresh(everything(), names, width, height, LOWLUX_STAGE_BAYER16);
  const Codes first = scene(names.format, width, height, 1), third = scene(names.format, width, height, 3);
  ASSERT_EQ(rig.process(first, numbered(names.format, 1)), LOWLUX_STAGE_OK);
  auto wrong = numbered(names.format, 2);
  wrong.black_level[0] = 1023;
  ASSERT_EQ(rig.process(first, wrong), LOWLUX_STAGE_BAD_PARAMETER);
  ASSERT_EQ(rig.process(third, numbered(names.format, 3)), LOWLUX_STAGE_OK);
  ASSERT_EQ(fresh.process(third, numbered(names.format, 3)), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.planes, fresh.planes);
}

TEST(Stage, AfterResetOrConfigureIsAFreshOneInAllItDecides) {
  const RawFormatNames& names = names_of_bayer(10);
  const Codes bright = scene(names.format, width, height, 1);
  Codes dark = bright;
  for (std::uint16_t& code : dark) code = static_cast<std::uint16_t>(64 + (code > 64 ? (code - 64) / 8 : 0));
  for (const bool resets : {true, false}) {
    Rig rig(everything(), names, width, height, LOWLUX_STAGE_BGR888),
        fresh(everything(), names, width, height, LOWLUX_STAGE_BGR888);
    for (int i = 0; i < 5; ++i) ASSERT_EQ(rig.process(bright, no_params()), LOWLUX_STAGE_OK);
    const auto before = rig.result;
    ASSERT_EQ(rig.process(dark, no_params()), LOWLUX_STAGE_OK);
    const float followed_ev = rig.result.exposure_ev;
    ASSERT_EQ(resets ? lowlux_stage_reset(rig.stage.get()) : lowlux_stage_configure(rig.stage.get(), &rig.in, &rig.out),
              LOWLUX_STAGE_OK);
    ASSERT_EQ(rig.process(dark, no_params()), LOWLUX_STAGE_OK);
    ASSERT_EQ(fresh.process(dark, no_params()), LOWLUX_STAGE_OK);
    EXPECT_EQ(rig.planes, fresh.planes);
    EXPECT_EQ(rig.result.exposure_ev, fresh.result.exposure_ev);
    EXPECT_GT(followed_ev, before.exposure_ev) << "exposure follows the scene ...";
    EXPECT_LT(followed_ev, fresh.result.exposure_ev) << "... slowly";
  }
}

lowlux_stage_params budgeted(const lowlux_stage_params& params, float budget_ms) {
  auto out = params;
  out.valid |= LOWLUX_STAGE_HAS_BUDGET;
  out.budget_ms = budget_ms;
  return out;
}

TEST(Stage, OfABudgetThatNothingFitsGivesThePictureWithoutNoiseReduction) {
  const RawFormatNames& names = names_of_bayer(10);
  for (const std::int32_t denoise :
       {LOWLUX_STAGE_DENOISE_FAST, LOWLUX_STAGE_DENOISE_HIGH_QUALITY, LOWLUX_STAGE_DENOISE_MINIMAL,
        LOWLUX_STAGE_DENOISE_AUTO, LOWLUX_STAGE_DENOISE_OFF}) {
    Rig rig(everything(), names, width, height, LOWLUX_STAGE_BGR888),
        plain(everything(), names, width, height, LOWLUX_STAGE_BGR888);
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Codes codes = scene(names.format, width, height, i);
      auto params = numbered(names.format, i);
      params.denoise = LOWLUX_STAGE_DENOISE_OFF;
      ASSERT_EQ(plain.process(codes, params), LOWLUX_STAGE_OK);
      params.denoise = denoise;
      ASSERT_EQ(rig.process(codes, budgeted(params, 0.01F)), LOWLUX_STAGE_OK) << rig.error();
      EXPECT_EQ(rig.planes, plain.planes) << denoise << ' ' << i;
      const bool asks = denoise != LOWLUX_STAGE_DENOISE_OFF;
      EXPECT_EQ(rig.result.step, asks ? LOWLUX_STAGE_STEP_PLAIN : LOWLUX_STAGE_STEP_ALL) << denoise;
      EXPECT_EQ(rig.result.level, LOWLUX_STAGE_LEVEL_NONE);
      EXPECT_EQ(rig.result.temporal, 0);
      EXPECT_EQ(rig.result.exposure_ev, plain.result.exposure_ev);
      EXPECT_EQ(std::memcmp(&rig.statistics, &plain.statistics, sizeof rig.statistics), 0);
      EXPECT_GT(rig.result.took_ms, 0.01) << "which is told";
      EXPECT_EQ(rig.result.predicted_ms > 0, i > 0) << "no time is known of the first frame";
    }
  }
}

TEST(Stage, OfAnAmpleBudgetGivesTheSameBytesAsWithoutOneOnceItHasSeenAFrame) {
  const RawFormatNames& names = names_of_bayer(10);
  for (const std::int32_t denoise :
       {LOWLUX_STAGE_DENOISE_HIGH_QUALITY, LOWLUX_STAGE_DENOISE_MINIMAL, LOWLUX_STAGE_DENOISE_AUTO}) {
    Rig rig(everything(), names, width, height, LOWLUX_STAGE_BGR888),
        free(everything(), names, width, height, LOWLUX_STAGE_BGR888);
    for (std::uint32_t i = 0; i < 4; ++i) {
      auto params = numbered(names.format, i);
      params.denoise = denoise;
      const Codes codes = scene(names.format, width, height, i);
      ASSERT_EQ(rig.process(codes, budgeted(params, 1e6F)), LOWLUX_STAGE_OK) << rig.error();
      EXPECT_EQ(rig.result.step, i == 0 ? LOWLUX_STAGE_STEP_PLAIN : LOWLUX_STAGE_STEP_ALL) << denoise;
      if (i == 0) continue;  // from here on frames before are the same for both
      ASSERT_EQ(free.process(codes, params), LOWLUX_STAGE_OK);
      EXPECT_EQ(rig.planes, free.planes) << denoise << ' ' << i;
      EXPECT_EQ(rig.result.level, free.result.level);
      EXPECT_EQ(rig.result.temporal, free.result.temporal);
    }
  }
}

TEST(Stage, InterpolatesAsTheSettingsStateAndWithABudgetByLinearFilters) {
  const RawFormatNames& names = names_of_bayer(10);
  const Codes codes = scene(names.format, width, height);
  auto params = numbered(names.format, 0);
  params.denoise = LOWLUX_STAGE_DENOISE_FAST;
  std::vector<std::vector<std::uint8_t>> pictures;
  for (const std::int32_t method :
       {LOWLUX_STAGE_DEMOSAIC_MALVAR, LOWLUX_STAGE_DEMOSAIC_ENCODED_MALVAR, LOWLUX_STAGE_DEMOSAIC_RESIDUAL}) {
    auto settings = everything();
    settings.demosaic = method;
    Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(std::count(pictures.begin(), pictures.end(), rig.planes[0]), 0) << method;
    pictures.push_back(rig.planes[0]);
  }
  auto settings = everything();
  Rig by_default(settings, names, width, height, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(by_default.process(codes, params), LOWLUX_STAGE_OK);
  EXPECT_EQ(by_default.planes[0], pictures[1]);
  settings.demosaic = LOWLUX_STAGE_DEMOSAIC_RESIDUAL;
  Rig budget(settings, names, width, height, LOWLUX_STAGE_BGR888),
      encoded(everything(), names, width, height, LOWLUX_STAGE_BGR888);
  auto off = params;
  off.denoise = LOWLUX_STAGE_DENOISE_OFF;
  ASSERT_EQ(budget.process(codes, budgeted(params, 0.01F)), LOWLUX_STAGE_OK);
  ASSERT_EQ(encoded.process(codes, off), LOWLUX_STAGE_OK);
  EXPECT_EQ(budget.planes, encoded.planes);
}

TEST(Stage, KeepsWhatItKnowsOfTimesWhenResetAndForgetsItWhenConfigured) {
  const RawFormatNames& names = names_of_bayer(10);
  Rig rig(everything(), names, width, height, LOWLUX_STAGE_BGR888);
  const Codes codes = scene(names.format, width, height);
  const auto params = numbered(names.format, 0);
  const auto step = [&](float budget_ms) {
    EXPECT_EQ(rig.process(codes, budgeted(params, budget_ms)), LOWLUX_STAGE_OK) << rig.error();
    return rig.result.step;
  };
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.result.step, LOWLUX_STAGE_STEP_ALL) << "without a budget";
  EXPECT_EQ(step(1e6F), LOWLUX_STAGE_STEP_ALL) << "times are known from frames without one too";
  ASSERT_EQ(lowlux_stage_reset(rig.stage.get()), LOWLUX_STAGE_OK);
  EXPECT_EQ(step(1e6F), LOWLUX_STAGE_STEP_ALL);
  EXPECT_GT(rig.result.predicted_ms, 0);
  ASSERT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &rig.out), LOWLUX_STAGE_OK);
  EXPECT_EQ(step(1e6F), LOWLUX_STAGE_STEP_PLAIN);
  EXPECT_EQ(rig.result.predicted_ms, 0);
}

// A still scene: the noise of clean mosaics falls with the number of frames.
TEST(Stage, FramesBeforeLowerTheNoiseOfAStillScene) {
  const RawFormatNames& names = names_of_bayer(10);
  Rig rig(everything(), names, width, height, LOWLUX_STAGE_BAYER16);
  const auto scatter = [&] {
    double sum = 0;
    int n = 0;
    for (int y = 0; y < height; ++y) {  // differences along columns of the flat left edge
      for (int x = 0; x + 2 < 60; ++x, ++n) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        const double d = rig.wide(i + 2) - rig.wide(i);
        sum += d * d;
      }
    }
    return sum / n;
  };
  double first = 0;
  for (std::uint32_t i = 0; i < 12; ++i) {
    auto params = numbered(names.format, i);
    params.denoise = LOWLUX_STAGE_DENOISE_MINIMAL;  // by frames before alone
    ASSERT_EQ(rig.process(scene(names.format, width, height, i), params), LOWLUX_STAGE_OK);
    if (i == 0) first = scatter();
    EXPECT_EQ(rig.result.level, LOWLUX_STAGE_LEVEL_NONE);
    EXPECT_EQ(rig.result.temporal, i > 0 ? 1 : 0);
  }
  EXPECT_LT(scatter(), first / 3) << "of twelve frames; slopes stay";
  EXPECT_LT(rig.result.moved, 0.1);
}

}  // namespace
}  // namespace lowlux::stage_test
