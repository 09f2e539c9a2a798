#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::two_threads;

/// A grey ramp, black at its left, over dark charge; black is tagged.
RawFrame ramp_over_dark(double dark_e, double floor_e, double exposure_s) {
  const auto scene = [floor_e](int x, int) {
    const double e = floor_e + 0.5 * x;
    return std::array{e / 2, e, e / 1.5};
  };
  RawFrame frame = test::night_frame({.dark_e = {dark_e, dark_e, dark_e, dark_e}}, scene, 320, 256);
  frame.raw.info.exposure_s = exposure_s;
  return frame;
}

DevelopPlan planned(const RawFrame& frame, const DevelopOptions& options = {}) {
  Result<DevelopPlan> plan = plan_develop(frame, options, two_threads);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

bool warns(const DevelopPlan& plan) {
  return std::ranges::any_of(plan.warnings, [](const std::string& warning) {
    return warning.find("the dark charge is unknown") != std::string::npos;
  });
}

DevelopOptions without_estimate() {
  DevelopOptions out;
  out.estimate_dark = false;
  return out;
}

TEST(UnknownDark, IsWarnedOfWithItsLargestSize) {
  const DevelopPlan plan = planned(ramp_over_dark(200, 0, 1), without_estimate());
  EXPECT_EQ(plan.dark.state, DarkCharge::State::unknown);
  ASSERT_TRUE(plan.dark.max_fraction);
  // Of 200 e- in the darkest block, the median has 0.71 * 80 e- more on average over the colours.
  EXPECT_NEAR(*plan.dark.max_fraction, 200 / (200 + 0.79 * 80), 0.05);
  EXPECT_TRUE(warns(plan));
  EXPECT_EQ(plan.levels.black.dark_mean_e, PerSite<double>{});
}

TEST(UnknownDark, IsNotMentionedWhereItIsKnownOrCannotMatter) {
  DevelopOptions with_dark = without_estimate();
  with_dark.black.dark_dn.fill(200 * test::night_gain_dn_per_e);
  RawFrame profiled = ramp_over_dark(200, 0, 1);  // a profile's noise is relative to white less pedestal and charge
  for (double& scale : profiled.noise->scale) scale *= test::night_full_e() / (test::night_full_e() - 200);
  const DevelopPlan known = planned(profiled, with_dark);
  EXPECT_FALSE(warns(known)) << "known from a profile";
  EXPECT_EQ(known.dark.state, DarkCharge::State::in_black_point);
  EXPECT_NEAR(*known.dark.mean_e, 200, 1e-9);
  for (const bool estimates : {false, true}) {
    DevelopOptions options;
    options.estimate_dark = estimates;
    const auto is_silent = [&](const RawFrame& frame, DarkCharge::State state) {
      const DevelopPlan plan = planned(frame, options);
      return !warns(plan) && plan.dark.state == state;
    };
    constexpr auto expects_none = DarkCharge::State::not_expected, examines_none = DarkCharge::State::not_examined;
    EXPECT_TRUE(is_silent(ramp_over_dark(0, 5, 1), expects_none)) << "the darkest block has little light";
    EXPECT_TRUE(is_silent(ramp_over_dark(0, 50, 1.0 / 60), expects_none)) << "a short exposure";
    RawFrame cold = ramp_over_dark(0, 50, 1);
    cold.raw.info.temperature_c = -20;
    EXPECT_TRUE(is_silent(cold, expects_none)) << "a cooled sensor";
    RawFrame clean = ramp_over_dark(200, 0, 1);
    clean.noise->reduced = true;
    EXPECT_TRUE(is_silent(clean, examines_none)) << "denoised before";
    RawFrame unstated = ramp_over_dark(200, 0, 1);
    unstated.raw.info.exposure_s.reset();
    EXPECT_TRUE(is_silent(unstated, examines_none)) << "no exposure time";
  }
}

// The darkest block has light of 40 e- in green: the estimate is well below its charge, 232 e- on average.
TEST(UnknownDark, IsEstimatedAndSubtractedWhereTheFrameShowsIt) {
  const RawFrame frame = ramp_over_dark(200, 40, 1);
  const DevelopPlan plan = planned(frame);
  EXPECT_FALSE(warns(plan));
  ASSERT_EQ(plan.dark.state, DarkCharge::State::estimated);
  EXPECT_NEAR(*plan.dark.mean_e, 200, 0.02 * 200);
  EXPECT_LT(*plan.dark.standard_error_e, 0.15 * 200);
  for (const double charge : plan.levels.black.dark_mean_e) EXPECT_NEAR(charge, 200, 0.03 * 200);
  // Camera RGB: the median column has light of 60, 120 and 80 e-.
  ASSERT_TRUE(plan.dark.alpha);
  EXPECT_NEAR(*plan.dark.alpha, (60 + 120 + 80.0) / (60 + 120 + 80 + 600), 0.02);
}

TEST(UnknownDark, OfASeriesIsThatOfItsOtherFrames) {
  const RawFrame frame = ramp_over_dark(200, 40, 1);
  DevelopOptions options = without_estimate();
  options.series_dark_e = {180, 185, 190, 195};
  const DevelopPlan plan = planned(frame, options);
  EXPECT_EQ(plan.dark.state, DarkCharge::State::estimated);
  EXPECT_EQ(plan.levels.black.dark_mean_e, *options.series_dark_e);
  EXPECT_NEAR(*plan.dark.mean_e, 187.5, 1e-9);
  EXPECT_FALSE(warns(plan));
}

// Frames of a bracket would differ if the charge were left in the short ones: 5 e- are 317 e- after 64 times as long.
TEST(UnknownDark, OfASeriesIsSubtractedFromShortExposuresToo) {
  DevelopOptions options;
  options.series_dark_e = {5, 5, 5, 5};
  const RawFrame brief = ramp_over_dark(5, 40, 0.05);
  EXPECT_EQ(planned(brief).dark.state, DarkCharge::State::not_expected);
  const DevelopPlan plan = planned(brief, options);
  EXPECT_EQ(plan.dark.state, DarkCharge::State::estimated);
  EXPECT_EQ(plan.levels.black.dark_mean_e, *options.series_dark_e);
}

TEST(UnknownDark, GrowsWithTimeAndDoublesEverySevenKelvin) {
  FrameInfo one, other;
  one.exposure_s = 4;
  other.exposure_s = 0.5;
  EXPECT_EQ(dark_charge_ratio(one, other), 8);
  one.temperature_c = 32;
  EXPECT_EQ(dark_charge_ratio(one, other), 8);
  other.temperature_c = 25;
  EXPECT_DOUBLE_EQ(dark_charge_ratio(one, other), 16);
  EXPECT_DOUBLE_EQ(dark_charge_ratio(other, one), 1.0 / 16);
}

/// Returns R, G and B in the middle of a saturated square of a ramp over dark charge, exposed as it is.
std::array<double, 3> saturated_colour(double dark_e, const DenoiseChoice& denoise, bool half) {
  constexpr int side = 64;
  RawFrame frame = ramp_over_dark(dark_e, 0, 1);
  for (int y = 0; y < side; ++y)
    std::fill_n(frame.raw.dn.row(y), side, static_cast<std::uint16_t>(frame.raw.white_dn[0]));
  const DevelopOptions options{.exposure_ev = 0,
                               .tone = ToneCurve::none,
                               .space = OutputSpace::linear_srgb,
                               .samples = SampleType::f32,
                               .half = half,
                               .denoise = denoise};
  const Result<Developed> out = develop(frame, options, two_threads);
  EXPECT_TRUE(out) << out.error().message;
  EXPECT_EQ(out->plan.dark.state, DarkCharge::State::estimated);
  const auto& picture = std::get<SceneLinear>(out->picture);
  const int middle = half ? side / 4 : side / 2;
  std::array<double, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<double>(picture.plane[c].at(middle, middle));
  return rgb;
}

// Light and dark charge saturate a pixel together: white is full without the charge that is subtracted. The charge is
// drawn up to a tenth of the full well, of which green would otherwise lack its part and turn magenta.
TEST(UnknownDark, SaturatedPixelsStayWhiteWhereAnEstimateIsSubtracted) {
  const std::uint64_t seed = 20261124;
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> log_dark(std::log(60.0), std::log(600.0));
  for (const bool half : {false, true}) {
    for (const DenoiseChoice& denoise :
         {DenoiseChoice{.mode = DenoiseChoice::Mode::off},
          DenoiseChoice{.mode = DenoiseChoice::Mode::level, .level = denoise::Level::draft},
          DenoiseChoice{.mode = DenoiseChoice::Mode::level, .level = denoise::Level::standard}}) {
      const double dark_e = std::exp(log_dark(engine));
      const std::array<double, 3> rgb = saturated_colour(dark_e, denoise, half);
      for (const double value : rgb) EXPECT_NEAR(value, 1, 1e-4) << dark_e << " e-, seed " << seed;
    }
  }
}

// Light of 50 e- in the darkest places is not taken for dark charge, although so long an exposure could have that.
TEST(UnknownDark, IsNotEstimatedFromAFrameWithoutIt) {
  const DevelopPlan plan = planned(ramp_over_dark(0, 50, 10));
  EXPECT_EQ(plan.dark.state, DarkCharge::State::unknown);
  EXPECT_TRUE(warns(plan));
  EXPECT_EQ(plan.levels.black.dark_mean_e, PerSite<double>{});
}

// More charge than any dark current makes is an offset of another kind.
TEST(UnknownDark, IsNotEstimatedBeyondAnyDarkCurrent) {
  RawFrame frame = ramp_over_dark(400, 0, 1);
  frame.raw.info.temperature_c = 15;  // at most 1000 / 2^(10 / 7) = 371 e-
  EXPECT_EQ(planned(frame).dark.state, DarkCharge::State::unknown);
  frame.raw.info.temperature_c = 17;  // 453 e-
  EXPECT_EQ(planned(frame).dark.state, DarkCharge::State::estimated);
}

// The planner leaves the estimate in only where that changes less than the tolerance.
TEST(UnknownDark, IsACandidateOfThePlanner) {
  const auto left_in = [](double tolerance, DenoiseChoice::Mode mode) {
    DevelopOptions options{.denoise = {.mode = mode}};
    options.effects.emplace(ProcessingGoal{.tolerance_delta_e = tolerance});
    const DevelopPlan plan = planned(ramp_over_dark(200, 0, 1), options);
    EXPECT_TRUE(
        std::ranges::any_of(plan.effects->effects, [](const PlannedStep& step) { return step.name == "dark charge"; }));
    return plan.levels.black.dark_mean_e == PerSite<double>{};
  };
  EXPECT_FALSE(left_in(0.5, DenoiseChoice::Mode::off));
  EXPECT_TRUE(left_in(200, DenoiseChoice::Mode::off));
  EXPECT_FALSE(left_in(0.5, DenoiseChoice::Mode::automatic));
  EXPECT_FALSE(left_in(0.5, DenoiseChoice::Mode::level));
}

TEST(UnknownDark, KnownChargeOfATaggedBlackKeepsColourAndNoiseModel) {
  // Twice as much red as blue, over dark charge of four times the signal.
  const auto scene = [](int x, int) {
    const double e = 20 + 0.1 * x;
    return std::array{e, e, e / 2};
  };
  RawFrame frame = test::night_frame({.dark_e = {100, 100, 100, 100}}, scene, 320, 256);
  frame.raw.info.exposure_s = 1;
  // A profile's noise is relative to white less pedestal and dark charge, and includes that of the dark charge.
  const double full_e = test::night_full_e() - 100, wider = test::night_full_e() / full_e;
  for (double& scale : frame.noise->scale) scale *= wider;
  for (double& offset : frame.noise->offset) offset = offset * wider * wider + 100 / (full_e * full_e);
  DevelopOptions options;
  options.black.dark_dn.fill(100 * test::night_gain_dn_per_e);
  options.denoise = {.mode = DenoiseChoice::Mode::level, .level = denoise::Level::standard};
  const DevelopPlan plan = planned(frame, options);
  EXPECT_FALSE(std::ranges::any_of(plan.warnings, [](const std::string& warning) {
    return warning.find("the noise variance that its model states") != std::string::npos;
  }));
  Pipeline pipeline(two_threads);
  const PlaneView<const float> signal = pipeline.signal(frame, plan);
  double sum = 0;
  for (int y = 0; y < signal.height; ++y) {
    for (int x = 0; x < signal.width; ++x) sum += static_cast<double>(signal.at(x, y));
  }
  const double mean_e = (20 + 0.1 * 159.5) * (1 + 2 + 0.5) / 4;
  // Five standard errors of photons, dark charge and read noise.
  EXPECT_NEAR(sum / (320 * 256), mean_e, 5 * std::sqrt((mean_e + 100 + 4) / (320 * 256)));
}

// The difference of a level that the user states from the tag is not dark charge.
TEST(KnownDark, IsTheStatedChargeWhateverPedestalIsGivenOrTagged) {
  DevelopOptions options;
  options.black = {.choice = BlackChoice::given, .dark_dn = {80, 40, 40, 120}};
  options.black.given_dn.fill(test::night_black_dn + 20);  // the tag is 20 DN lower
  const RawFrame frame = ramp_over_dark(20, 0, 1);
  const DarkCharge given = planned(frame, options).dark;
  EXPECT_EQ(given.state, DarkCharge::State::in_black_point);
  EXPECT_NEAR(*given.mean_e, 70 / test::night_gain_dn_per_e, 0.02 * 70 / test::night_gain_dn_per_e);
  EXPECT_NEAR(given.charge_e[3], 120 / test::night_gain_dn_per_e, 0.02 * 120 / test::night_gain_dn_per_e);
  options.black.choice = BlackChoice::metadata;
  EXPECT_NEAR(*planned(frame, options).dark.mean_e, 70 / test::night_gain_dn_per_e,
              0.02 * 70 / test::night_gain_dn_per_e);
  options.black.choice = BlackChoice::given;
  options.black.dark_dn = {};
  EXPECT_NE(planned(frame, options).dark.state, DarkCharge::State::in_black_point) << "a pedestal alone";
}

TEST(KnownDark, OfMaskedPixelsIsTheirDifferenceFromTheMeanOfTheTag) {
  constexpr int border = 64, side = 256;
  RawFrame frame = test::night_frame({.dark_e = {30, 30, 30, 30}}, denoise_testing::flat(0, 0, 0), border + side, side);
  frame.raw.active = frame.raw.default_crop = {border, 0, side, side};
  frame.raw.masked = {{0, 0, border, side}};
  frame.raw.masked_is_stated = true;
  // A pattern of four rows whose first cell is 25 DN above its mean, the pedestal.
  frame.raw.black_tag = BlackLevel{.rows = 4, .pattern_dn = {25, 25, -25, -25}};
  for (double& dn : frame.raw.black_tag->pattern_dn) dn += test::night_black_dn;
  DevelopOptions options;
  options.black.choice = BlackChoice::masked;
  const DarkCharge dark = planned(frame, options).dark;
  ASSERT_TRUE(dark.mean_e && dark.standard_error_e);
  EXPECT_NEAR(*dark.mean_e, 30, 5 * *dark.standard_error_e);
  EXPECT_LT(*dark.standard_error_e, 1);
}

TEST(SignalFraction, CountsTheChargeOfEachChannel) {
  RawFrame frame = ramp_over_dark(0, 0, 1);
  RawLevels levels;
  levels.electrons_at_white = PerSite<double>{1000, 1000, 1000, 1000};
  Thumbnail light{.mean = CameraRgb(8, 8)};
  constexpr std::array<float, 3> fraction{0.125F, 0.25F, 0.375F};
  for (std::size_t c = 0; c < 3; ++c) std::fill_n(light.mean.plane[c].data(), 64, fraction[c]);
  PerSite<double> charge_e{};
  constexpr std::array<double, 3> of_colour{40, 20, 60};
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1));
    charge_e[site] = of_colour[c] + (c == 1 ? (site < 2 ? 10 : -10) : 0);  // the greens differ too
  }
  const auto alpha = signal_fraction_at_median(frame, levels, {}, light, charge_e);
  ASSERT_TRUE(alpha);
  EXPECT_NEAR(*alpha, 0.75 / (0.75 + 0.120), 1e-7);  // floats
}

// Masked pixels hold a dark charge of 0.05 e-, one pixel in twenty, at 40 DN/e-: with the gain of the noise profile its
// mean of 2 DN is in the black point, without it would be taken for outliers.
TEST(MaskedDark, OfFewElectronsIsMeasuredWithTheGainOfTheFrame) {
  constexpr int border = 64, side = 512;
  constexpr double gain_dn_per_e = 40, dark_e = 0.05, read_dn = 4;
  RawFrame frame = test::night_frame({}, denoise_testing::flat(100, 200, 125), border + side, side);
  std::mt19937_64 engine(3);
  std::poisson_distribution<int> charge(dark_e);
  std::normal_distribution<double> read(0, read_dn);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < border; ++x) {
      const double dn = test::night_black_dn + gain_dn_per_e * charge(engine) + read(engine);
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(dn));
    }
  }
  frame.raw.active = frame.raw.default_crop = {border, 0, side, side};
  frame.raw.masked = {{0, 0, border, side}};
  frame.raw.masked_is_stated = true;
  frame.noise->scale.fill(gain_dn_per_e / (test::night_white_dn - test::night_black_dn));
  const double error = std::sqrt((gain_dn_per_e * gain_dn_per_e * dark_e + read_dn * read_dn) / (12.0 * side));
  const auto mean_dn = [](const BlackPoint& black) {
    return (black.pedestal_dn[0] + black.pedestal_dn[1] + black.pedestal_dn[2] + black.pedestal_dn[3]) / 4;
  };
  EXPECT_NEAR(mean_dn(planned(frame).levels.black), test::night_black_dn + gain_dn_per_e * dark_e, 5 * error / 2);
  frame.noise.reset();
  EXPECT_NEAR(mean_dn(planned(frame).levels.black), test::night_black_dn, 5 * read_dn / std::sqrt(48.0 * side) + 0.1);
}

}  // namespace
}  // namespace lowlux::isp
