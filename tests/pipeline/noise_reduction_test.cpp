#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <utility>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp::noise_reduction_test {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::flat;
using test::one_thread;
using Mode = DenoiseChoice::Mode;

DevelopOptions linear(const DenoiseChoice& choice) {
  DevelopOptions options{
      .exposure_ev = 0, .tone = ToneCurve::none, .space = OutputSpace::linear_srgb, .samples = SampleType::f32};
  options.find_defects = false;
  options.denoise = choice;
  return options;
}

DevelopPlan planned(const RawFrame& frame, const DenoiseChoice& choice) {
  Result<DevelopPlan> plan = plan_develop(frame, linear(choice), one_thread);
  EXPECT_TRUE(plan) << plan.error().message;
  return *std::move(plan);
}

Developed developed(const RawFrame& frame, const DenoiseChoice& choice) {
  Result<Developed> out = develop(frame, linear(choice), one_thread);
  EXPECT_TRUE(out) << out.error().message;
  return *std::move(out);
}

// A neutral of so many electrons of green; red and blue get what the camera's neutral leaves them.
denoise_testing::Scene grey(double green_e) { return flat(0.5 * green_e, green_e, 0.625 * green_e); }

/// Root mean square distance of green from that of the scene, away from the borders.
double green_error(const Developed& out, double expected) {
  const auto& green = std::get<SceneLinear>(out.picture).plane[1];
  double sum = 0;
  int count = 0;
  for (int y = 16; y < green.height() - 16; ++y) {
    for (int x = 16; x < green.width() - 16; ++x, ++count) sum += std::pow(green.at(x, y) - expected, 2);
  }
  return std::sqrt(sum / count);
}

TEST(NoiseReduction, LevelsGoByTheSignalToNoiseRatio) {
  EXPECT_EQ(level_for(0), Level::high);
  EXPECT_EQ(level_for(2.99), Level::high);
  EXPECT_EQ(level_for(3), Level::standard);
  EXPECT_EQ(level_for(19.9), Level::standard);
  EXPECT_EQ(level_for(20), Level::draft);
  EXPECT_EQ(level_for(59.9), Level::draft);
  EXPECT_EQ(level_for(60), std::nullopt);
}

TEST(NoiseReduction, ThePredictedRatioIsThatOfAPixel) {
  const Camera camera{.read_noise_e = 3};
  const auto plan = planned(test::night_frame(camera, flat(20, 40, 30), 256, 256), {.mode = Mode::automatic});
  const double variance = 32.5 + 9 + 1.0 / 12 / 16;  // mean of the four sites, and what the model says beyond it
  ASSERT_TRUE(plan.noise_reduction.snr);
  // Of the middle block; blocks are single pixels of the thumbnail, means of at least one cell.
  EXPECT_NEAR(*plan.noise_reduction.snr, 32.5 / std::sqrt(variance), 0.5);
  EXPECT_EQ(plan.noise_reduction.level, Level::standard);
  EXPECT_EQ(plan.noise_reduction.source, NoiseProfile::Source::file);
}

TEST(NoiseReduction, GainsMakeANeutralEqualInElectrons) {
  RawFrame frame = test::night_frame({}, grey(50), 64, 64);
  const auto same = planned(frame, {.mode = Mode::level}).noise_reduction.options.white_gain;
  EXPECT_NEAR(same[0], 2, 1e-6);
  EXPECT_NEAR(same[1], 1, 1e-6);
  EXPECT_NEAR(same[2], 1.6, 1e-6);
  frame.noise->scale[0] /= 2;  // red counts two electrons for each of the others'
  EXPECT_NEAR(planned(frame, {.mode = Mode::level}).noise_reduction.options.white_gain[0], 1, 1e-6);
}

TEST(NoiseReduction, EveryLevelBringsAFlatCloserToTheSceneAndAutomaticDoesToo) {
  const double green_e = 20, expected = green_e / test::night_full_e();
  const RawFrame frame = test::night_frame({}, grey(green_e), 160, 128);
  const double before = green_error(developed(frame, {}), expected);
  for (const Level level : denoise::all_levels) {
    const Developed out = developed(frame, {Mode::level, level});
    EXPECT_EQ(out.plan.noise_reduction.level, level);
    EXPECT_LT(green_error(out, expected), 0.2 * before) << name_of(level);  // a mean of some hundred cells
  }
  EXPECT_LT(green_error(developed(frame, {.mode = Mode::automatic}), expected), 0.2 * before);
}

TEST(NoiseReduction, DarkChargeThatTheBlackPointKnowsIsTakenOffWithItsNoise) {
  const Camera camera{.dark_e = {200, 200, 200, 200}, .read_noise_e = 4};
  RawFrame frame = test::night_frame(camera, grey(40), 160, 128);
  DevelopOptions options = linear({Mode::level, Level::standard});
  options.black.choice = BlackChoice::measured;
  options.black.measured.emplace().pedestal_dn.fill(test::night_black_dn);
  options.black.measured->dark_mean_e = camera.dark_e;
  const auto out = develop(frame, options, one_thread);
  ASSERT_TRUE(out);
  EXPECT_EQ(out->plan.noise_reduction.noise.dark_mean_e, camera.dark_e);
  // 15.5 e- of noise, a twentieth of it left
  const double light_at_white_e = test::night_full_e() - 200;
  EXPECT_LT(green_error(*out, 40 / light_at_white_e), 1.5 / light_at_white_e);
}

// DenoiserColour has what the prior does to colours.
TEST(NoiseReduction, ColourHasAPriorUnlessNoBiasIsAskedFor) {
  const RawFrame frame = test::night_frame({}, grey(5), 64, 64);
  const auto least_error = planned(frame, {.mode = Mode::automatic}).noise_reduction;
  EXPECT_EQ(least_error.options.rho, denoise::DenoiseOptions{}.rho);
  EXPECT_FALSE(least_error.options.keep_means);
  RawFrame grey_frame = test::night_frame({}, grey(5), 64, 64);
  grey_frame.raw.layout = SensorLayout::monochrome;
  for (const RawFrame* of : {&frame, &std::as_const(grey_frame)}) {
    const auto unbiased = planned(*of, {.mode = Mode::automatic, .unbiased_chroma = true}).noise_reduction;
    EXPECT_TRUE(std::isinf(unbiased.options.rho));
    EXPECT_TRUE(unbiased.options.keep_means);
  }
}

TEST(NoiseReduction, UnknownNoiseIsLeftOrAnErrorIfALevelWasAskedFor) {
  RawFrame frame = test::night_frame({}, grey(20), 64, 64);
  frame.noise.reset();
  const Developed off = developed(frame, {}), automatic = developed(frame, {.mode = Mode::automatic});
  EXPECT_EQ(automatic.plan.noise_reduction.level, std::nullopt);
  EXPECT_NE(automatic.plan.noise_reduction.reason.find("NoiseProfile"), std::string::npos);
  const auto &a = std::get<SceneLinear>(off.picture).plane[0], &b = std::get<SceneLinear>(automatic.picture).plane[0];
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  const auto asked = plan_develop(frame, linear({Mode::level, Level::draft}), one_thread);
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().code, ErrorCode::insufficient);
}

TEST(NoiseReduction, FramesWithoutMosaicAreReducedByTheirRatioOrAsAskedFor) {
  RawFrame frame = test::night_frame({}, grey(20), 64, 64);
  frame.raw.layout = SensorLayout::monochrome;
  const auto plan = planned(frame, {.mode = Mode::automatic});
  ASSERT_TRUE(plan.noise_reduction.snr);
  EXPECT_NE(plan.noise_reduction.level, std::nullopt);
  EXPECT_EQ(plan.noise_reduction.level, level_for(*plan.noise_reduction.snr));
  EXPECT_EQ(planned(frame, {Mode::level, Level::draft}).noise_reduction.level, Level::draft);
}

TEST(NoiseReduction, ABrightFrameIsLeftUnlessItIsAlwaysToBeReduced) {
  const RawFrame frame = test::night_frame({}, grey(3900), 128, 96);
  const auto plan = planned(frame, {.mode = Mode::automatic});
  EXPECT_EQ(plan.noise_reduction.level, level_for(*plan.noise_reduction.snr));
  RawFrame brighter = test::night_frame({}, grey(3900), 128, 96);
  for (auto& s : brighter.noise->scale) s /= 4;
  for (auto& o : brighter.noise->offset) o /= 16;
  const auto bright = planned(brighter, {.mode = Mode::automatic});
  EXPECT_EQ(bright.noise_reduction.level, std::nullopt);
  EXPECT_TRUE(bright.from_codes);
  EXPECT_EQ(planned(brighter, {.mode = Mode::automatic, .always = true}).noise_reduction.level, Level::draft);
}

TEST(NoiseReduction, AGainThatIsFourTimesOffIsWarnedOf) {
  const RawFrame right = test::night_frame({}, grey(100), 256, 256);
  EXPECT_TRUE(planned(right, {.mode = Mode::level}).warnings.empty());
  for (const double factor : {0.25, 4.0}) {
    RawFrame wrong = test::night_frame({}, grey(100), 256, 256);
    for (auto& s : wrong.noise->scale) s *= factor;
    for (auto& o : wrong.noise->offset) o *= factor;
    const auto warnings = planned(wrong, {.mode = Mode::level}).warnings;
    ASSERT_FALSE(warnings.empty()) << factor;
    EXPECT_NE(warnings.back().find("the noise variance that its model states"), std::string::npos) << warnings.back();
  }
}

// Nobody can act on a warning about a model that was measured on the frame itself, or about less noise than stated
// where the file states that it was reduced.
TEST(NoiseReduction, WhatIsExpectedOfAModelIsNotWarnedOf) {
  const auto warnings_of = [](double factor, NoiseProfile::Source source, bool reduced) {
    RawFrame frame = test::night_frame({}, grey(100), 256, 256);
    for (auto& s : frame.noise->scale) s *= factor;
    for (auto& o : frame.noise->offset) o *= factor;
    frame.noise->source = source;
    frame.noise->reduced = reduced;
    return planned(frame, {.mode = Mode::level}).warnings.size();
  };
  using Source = NoiseProfile::Source;
  for (const double factor : {0.25, 4.0}) {
    EXPECT_EQ(warnings_of(factor, Source::picture, false), 0U) << factor;
    EXPECT_EQ(warnings_of(factor, Source::profile, false), 1U) << factor;
    EXPECT_EQ(warnings_of(factor, Source::file, true), factor < 1 ? 1U : 0U) << factor;
  }
}

// A second time loses detail; who asks for a level gets it.
TEST(NoiseReduction, ARawThatWasDenoisedIsDenoisedAgainOnRequestOnly) {
  for (const auto source : {NoiseProfile::Source::file, NoiseProfile::Source::picture}) {
    RawFrame frame = test::night_frame({}, grey(20), 128, 96);
    frame.noise->source = source;
    EXPECT_TRUE(planned(frame, {.mode = Mode::automatic}).noise_reduction.level);
    frame.noise->reduced = true;
    const auto plan = planned(frame, {.mode = Mode::automatic});
    EXPECT_FALSE(plan.noise_reduction.level);
    EXPECT_EQ(plan.noise_reduction.reason, "the raw was denoised before");
    EXPECT_TRUE(planned(frame, {.mode = Mode::automatic, .always = true}).noise_reduction.level);
    EXPECT_EQ(planned(frame, {.mode = Mode::level, .level = Level::standard}).noise_reduction.level, Level::standard);
  }
}

TEST(NoiseReduction, APedestalThatIsTooHighIsWarnedOf) {
  const RawFrame frame = test::night_frame({}, grey(1), 256, 256);
  DevelopOptions options = linear({.mode = Mode::level});
  options.black.choice = BlackChoice::given;
  options.black.given_dn.fill(test::night_black_dn + 20);
  const auto plan = plan_develop(frame, options, one_thread);
  ASSERT_TRUE(plan);
  ASSERT_FALSE(plan->warnings.empty());
  EXPECT_NE(plan->warnings.front().find("black level is suspicious"), std::string::npos) << plan->warnings.front();
}

RawFrame with_row_noise(double std_e) {
  RawFrame frame = test::night_frame({}, grey(20), 256, 256);
  std::vector<float> normal(256);
  normal_row({.seed = 7}, 0, 0, 2, normal);
  for (int y = 0; y < 256; ++y) {
    const auto shift =
        static_cast<int>(std::lround(test::night_gain_dn_per_e * std_e * static_cast<double>(normal[y])));
    for (int x = 0; x < 256; ++x) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(frame.raw.dn.at(x, y) + shift);
  }
  return frame;
}

TEST(NoiseReduction, RowNoiseIsTakenOffWhereItStandsOut) {
  const auto lines = planned(with_row_noise(1), {.mode = Mode::level}).noise_reduction.lines;
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].lines, denoise::Lines::rows);
  EXPECT_NEAR(lines[0].line_std_e, 1, 5 / std::sqrt(2.0 * 256) + 0.1);  // of 256 rows, and of their measurement
  EXPECT_TRUE(planned(with_row_noise(0), {.mode = Mode::level}).noise_reduction.lines.empty());
  EXPECT_TRUE(planned(with_row_noise(1), {.mode = Mode::level, .line_noise = false}).noise_reduction.lines.empty());
}

bool warns_of_rows(const DevelopPlan& plan) {
  return std::ranges::any_of(plan.warnings, [](const std::string& warning) {
    return warning.starts_with("rows have offsets of ") && warning.find("are not corrected") != std::string::npos;
  });
}

TEST(NoiseReduction, StrongRowNoiseIsSubtractedAndWhatIsLeftIsInTheModel) {
  for (const double std_e : {10.0, 20.0, 30.0}) {
    const DevelopPlan plan = planned(with_row_noise(std_e), {.mode = Mode::level});
    EXPECT_FALSE(warns_of_rows(plan)) << std_e;
    ASSERT_EQ(plan.noise_reduction.lines.size(), 1U) << std_e;
    const denoise::LineOffsets& lines = plan.noise_reduction.lines[0];
    EXPECT_NEAR(lines.line_std_e, std_e, 5 * std_e / std::sqrt(2.0 * 256)) << "of 256 rows";
    EXPECT_LT(lines.residual_std_e, 0.5 * std_e);
    const auto of_pixels = planned(with_row_noise(0), {.mode = Mode::level}).noise_reduction.noise.variance_e2;
    for (std::size_t c = 0; c < 3; ++c) {
      const double left_e2 = lines.residual_std_e * lines.residual_std_e;
      EXPECT_NEAR(plan.noise_reduction.noise.variance_e2[c], of_pixels[c] + left_e2, 1e-9 * left_e2);
    }
  }
}

// A blind adds light: more to green than to red and blue, whatever the light is.
TEST(NoiseReduction, ABlindStaysWithAWarning) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> share(0.25, 0.7), log_step(std::log(6.0), std::log(60.0));
  std::uniform_int_distribution<int> slat(2, 9);
  for (int i = 0; i < 40; ++i) {
    const double step_e = std::exp(log_step(engine)), red = share(engine), blue = share(engine);
    const int rows = slat(engine);
    const auto scene = [&](int, int y) {
      const double e = 20 + (y / rows % 2 == 0 ? step_e : 0);
      return std::array{red * e, e, blue * e};
    };
    const DevelopPlan plan = planned(test::night_frame({}, scene, 512, 512), {.mode = Mode::level});
    // Wide slats are edges, between which lines do not differ.
    for (const denoise::LineOffsets& lines : plan.noise_reduction.lines) {
      EXPECT_LT(lines.line_std_e, 2) << step_e << ' ' << red << ' ' << blue << ' ' << rows;
    }
    if (rows > 3) continue;
    EXPECT_TRUE(plan.noise_reduction.lines.empty()) << step_e << ' ' << red << ' ' << blue << ' ' << rows;
    EXPECT_TRUE(warns_of_rows(plan)) << step_e << ' ' << red << ' ' << blue << ' ' << rows;
  }
}

TEST(NoiseReduction, MapsAreThoseOfTheActiveAreaIfAskedFor) {
  RawFrame frame = test::night_frame({}, grey(20), 97, 63);
  frame.raw.default_crop = {8, 8, 64, 32};
  EXPECT_TRUE(developed(frame, {.mode = Mode::level}).noise_maps.chroma_confidence.empty());
  const Developed out = developed(frame, {.mode = Mode::level, .maps = true});
  EXPECT_EQ(out.noise_maps.chroma_confidence.width(), 49);
  EXPECT_EQ(out.noise_maps.residual_variance_e2.height(), 32);
  EXPECT_GT(out.noise_maps.residual_variance_e2.at(20, 20), 0);
  EXPECT_LE(out.noise_maps.chroma_confidence.at(20, 20), 1);
  EXPECT_EQ(std::get<SceneLinear>(out.picture).width(), 64);
}

// A flat of gain 2 and 10 % of noise: the map has 4 V, and with that noise 1 % of the square of the signal in addition.
TEST(NoiseReduction, MapsHoldTheNoiseOfMeasuredGains) {
  RawFrame frame = test::night_frame({}, grey(200), 128, 96);
  GainMap flat{.bottom = 96, .right = 128};
  flat.gain = {2};
  frame.corrections.gain_maps = {flat};
  const Developed exact = developed(frame, {.mode = Mode::level, .maps = true});
  frame.corrections.gain_maps[0].noise.fill({.shot = 0.003, .read = 0.001});
  const Developed measured = developed(frame, {.mode = Mode::level, .maps = true});
  const Plane<float>&before = exact.noise_maps.residual_variance_e2, &after = measured.noise_maps.residual_variance_e2;
  double added = 0;
  for (std::size_t i = 0; i < before.size(); ++i) added += (after.data()[i] - before.data()[i]) / before.size();
  const double square_e2 = 400.0 * 400 * (0.25 + 1 + 1 + 0.625 * 0.625) / 4;
  // The signal is denoised: its own variance adds less than 1 % to its square, and the mean of the frame is known to 1
  // %.
  EXPECT_NEAR(added, (0.003 * 2 + 0.001 * 4) * square_e2, 0.03 * 0.01 * square_e2);
}

TEST(NoiseReduction, OnePipelineTakesFramesOfAnySizeAndLevelOneAfterTheOther) {
  Pipeline pipeline(one_thread);
  for (const Level level : {Level::draft, Level::best, Level::high}) {
    for (const int width : {96, 40, 122}) {
      const RawFrame frame = test::night_frame({}, grey(20), width, 70);
      const DevelopPlan plan = planned(frame, {Mode::level, level});
      Picture again = make_picture(plan);
      pipeline.render(frame, plan, again);
      const Developed fresh = developed(frame, {Mode::level, level});
      const auto &a = std::get<SceneLinear>(again).plane[1], &b = std::get<SceneLinear>(fresh.picture).plane[1];
      EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0) << width;
    }
  }
}

// Masked pixels of some cameras have twice the variance of those of the image (Canon EOS Kiss X4, bundled).
TEST(NoiseReduction, NoiseMeasuredOnTheImageIsNotRaisedToThatOfMaskedPixels) {
  constexpr int border = 64, side = 256;
  std::mt19937_64 engine(17);
  for (int i = 0; i < 12; ++i) {
    const double read_e = std::exp(std::uniform_real_distribution(std::log(0.5), std::log(8.0))(engine));
    const double masked_e = read_e * std::uniform_real_distribution(0.5, 4.0)(engine);
    SCOPED_TRACE(testing::Message() << "read noise " << read_e << " e-, of masked pixels " << masked_e << " e-");
    RawFrame frame = test::night_frame({.read_noise_e = read_e}, grey(40), border + side, side);
    std::normal_distribution<double> noise_dn(test::night_black_dn, masked_e * test::night_gain_dn_per_e);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < border; ++x) {
        frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::max(noise_dn(engine), 0.0)));
      }
    }
    frame.raw.active = frame.raw.default_crop = {border, 0, side, side};
    frame.raw.masked = {{0, 0, border, side}};
    frame.raw.masked_is_stated = true;
    const double rounding_e2 = 1.0 / 12 / (test::night_gain_dn_per_e * test::night_gain_dn_per_e);
    const double model_e2 = read_e * read_e + rounding_e2, measured_e2 = masked_e * masked_e + rounding_e2;
    constexpr double sites = 48.0 * side / 4;           // of red or blue: 48 columns are measured
    const double tolerance = 5 * std::sqrt(2 / sites);  // of a variance
    for (const auto source :
         {NoiseProfile::Source::file, NoiseProfile::Source::profile, NoiseProfile::Source::picture}) {
      frame.noise->source = source;
      const bool is_of_image = source == NoiseProfile::Source::picture;
      const NoiseReduction found = planned(frame, {.mode = Mode::level}).noise_reduction;
      for (const double variance_e2 : found.noise.variance_e2) {
        const double expected_e2 = is_of_image ? model_e2 : std::max(model_e2, measured_e2);
        EXPECT_NEAR(variance_e2, expected_e2, (is_of_image ? 1e-6 : tolerance) * expected_e2);
      }
    }
  }
}

TEST(NoiseReduction, FramesOfAFewPixelsAreDeveloped) {
  for (const int size : {2, 3, 5, 9, 17}) {
    const Developed out = developed(test::night_frame({}, grey(20), size, size), {.mode = Mode::level, .maps = true});
    for (const float value : {std::get<SceneLinear>(out.picture).plane[1].at(size - 1, size - 1),
                              out.noise_maps.residual_variance_e2.at(0, 0)}) {
      EXPECT_TRUE(std::isfinite(value)) << size;
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::noise_reduction_test
