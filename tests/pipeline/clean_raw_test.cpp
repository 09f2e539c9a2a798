#include "isp/pipeline/finished/clean_raw.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "isp/base/random/random.h"
#include "isp/pipeline/finished/residual_profile.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp::clean_raw_test {
namespace {

using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::flat;
using test::one_thread;
using Mode = DenoiseChoice::Mode;

DevelopOptions options_for(Level level) {
  DevelopOptions options{
      .exposure_ev = 0, .tone = ToneCurve::none, .space = OutputSpace::camera, .samples = SampleType::f32};
  options.denoise = {Mode::level, level};
  options.find_defects = false;
  return options;
}

CleanRaw cleaned(const RawFrame& frame, const DevelopOptions& options = options_for(Level::standard)) {
  Result<CleanRaw> out = clean_raw(frame, options, one_thread);
  EXPECT_TRUE(out) << out.error().message;
  return *std::move(out);
}

/// Means of R, G, B in electrons.
std::array<double, 3> means_e(const RawFrame& clean) {
  const RawDn& raw = clean.raw;
  const double black = raw.black_tag->pattern_dn[0];
  std::array<double, 3> sum{}, count{};
  for (int y = 0; y < raw.dn.height(); ++y) {
    for (int x = 0; x < raw.dn.width(); ++x) {
      const auto c = static_cast<std::size_t>(colour_at(raw.phase, x, y));
      sum[c] += (raw.dn.at(x, y) - black) / (raw.white_dn[c] - black) * test::night_full_e();
      count[c] += 1;
    }
  }
  return {sum[0] / count[0], sum[1] / count[1], sum[2] / count[2]};
}

TEST(CleanRaw, KeepsTheMeanOfEveryColourBelowACodeToo) {
  for (const double green_e : {0.0, 0.05, 3.0, 300.0}) {
    const Camera camera{.phase = BayerPhase::gbrg};
    const CleanRaw clean = cleaned(test::night_frame(camera, flat(green_e / 2, green_e, 0.7 * green_e), 256, 256));
    const std::array expected{green_e / 2, green_e, 0.7 * green_e};
    const auto got = means_e(clean.frame);
    for (int c = 0; c < 3; ++c) {
      // rho moves chroma towards neutral by at most its share at the least light: 2 %
      const double error = std::sqrt((expected[c] + 2.25 + 0.01) / (256.0 * 256 / (c == 1 ? 2 : 4)));
      EXPECT_NEAR(got[c], expected[c], 5 * error + 0.02 * green_e) << c << " at " << green_e;
    }
  }
}

TEST(CleanRaw, NegativeElectronsSurvive) {
  const CleanRaw clean = cleaned(test::night_frame({.read_noise_e = 8}, flat(0, 0, 0), 128, 128));
  const auto& dn = clean.frame.raw.dn;
  const double black = clean.frame.raw.black_tag->pattern_dn[0];
  const auto [least, most] = std::minmax_element(dn.data(), dn.data() + dn.size());
  EXPECT_LT(*least, black);
  EXPECT_GT(*least, 0);
  EXPECT_GT(*most, black);
}

TEST(CleanRaw, SaturatedPixelsStayAtWhite) {
  RawFrame frame = test::night_frame({}, flat(10, 20, 15), 96, 96);
  for (int y = 40; y < 48; ++y) {
    for (int x = 40; x < 48; ++x) frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(test::night_white_dn);
  }
  const CleanRaw clean = cleaned(frame);
  for (int y = 40; y < 48; ++y) {
    for (int x = 40; x < 48; ++x) EXPECT_EQ(clean.frame.raw.dn.at(x, y), 65535);
  }
  EXPECT_LT(clean.frame.raw.dn.at(20, 20), 10000);
}

TEST(CleanRaw, MetadataRemainAndAppliedCorrectionsAreRemoved) {
  RawFrame frame = test::night_frame({.phase = BayerPhase::grbg}, flat(10, 20, 15), 96, 64);
  frame.raw.active = {16, 0, 80, 64};
  frame.raw.default_crop = {4, 6, 70, 50};
  frame.raw.masked = {{0, 0, 8, 64}};
  frame.raw.info.make = "Maker";
  frame.raw.info.iso = 3200;
  frame.raw.info.orientation = Orientation::rotate_90;
  frame.corrections.defects = {{3, 3, 1, 1}};
  frame.corrections.radial_gains = {{.k = {0.1, 0, 0, 0, 0}}};
  const RawFrame clean = cleaned(frame).frame;
  EXPECT_EQ(clean.raw.dn.width(), 80);
  EXPECT_EQ(clean.raw.active, (Rect{0, 0, 80, 64}));
  EXPECT_EQ(clean.raw.default_crop, frame.raw.default_crop);
  EXPECT_EQ(clean.raw.phase, BayerPhase::grbg);
  EXPECT_TRUE(clean.raw.masked.empty());
  EXPECT_EQ(clean.raw.info.make, "Maker");
  EXPECT_EQ(clean.raw.info.iso, 3200);
  EXPECT_EQ(clean.raw.info.orientation, Orientation::rotate_90);
  EXPECT_EQ(clean.colour.as_shot_neutral, frame.colour.as_shot_neutral);
  EXPECT_TRUE(clean.corrections.defects.empty());
  EXPECT_EQ(clean.corrections.radial_gains.size(), 1u);
}

/// Mean and variance of green away from the borders, in fractions of white.
std::pair<double, double> green_of(const RawDn& raw) {
  const double black = raw.black_tag->pattern_dn[0], range = raw.white_dn[1] - black;
  double sum = 0, squares = 0;
  int count = 0;
  for (int y = 16; y < raw.dn.height() - 16; ++y) {
    for (int x = 16; x < raw.dn.width() - 16; ++x) {
      if (colour_at(raw.phase, x, y) != CfaColour::green) continue;
      const double v = (raw.dn.at(x, y) - black) / range;
      sum += v;
      squares += v * v;
      ++count;
    }
  }
  return {sum / count, squares / count - sum / count * (sum / count)};
}

// A flat is where the profile's one line tells all: its variance is that of the codes. What is left are patches of
// noise that passed, few of which are from coarse levels: the variance of a frame is known to some 15 %, of six to 6 %.
// The limits are those of the denoiser's own prediction (DenoiserFlats).
TEST(CleanRaw, TheNoiseProfileIsThatOfTheCleanCodes) {
  double measured = 0, predicted = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const RawFrame frame = test::night_frame({}, flat(50, 100, 60), 384, 384, seed);
    const RawFrame clean = cleaned(frame, options_for(Level::draft)).frame;
    const auto [mean, variance] = green_of(clean.raw);
    measured += variance;
    predicted += clean.noise->scale[1] * mean + clean.noise->offset[1];
  }
  EXPECT_GT(std::sqrt(predicted / measured), 0.9);
  EXPECT_LT(std::sqrt(predicted / measured), 1.15);
}

TEST(CleanRaw, FramesWithoutMosaicOrNoiseModelAreErrors) {
  RawFrame unknown = test::night_frame({}, flat(10, 20, 15), 64, 64);
  unknown.noise.reset();
  DevelopOptions automatic = options_for(Level::standard);
  automatic.denoise = {.mode = Mode::automatic, .always = true};
  const auto out = clean_raw(unknown, automatic, one_thread);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::insufficient);
  EXPECT_NE(out.error().message.find("noise is unknown"), std::string::npos);
  EXPECT_NE(out.error().message.find("--profile"), std::string::npos);
}

TEST(CleanRaw, IsTheSameForEveryNumberOfThreads) {
  const RawFrame frame = test::night_frame({}, flat(10, 20, 15), 150, 130);
  const CleanRaw one = cleaned(frame);
  PoolExecutor pool(3);
  const auto three = clean_raw(frame, options_for(Level::standard), pool);
  ASSERT_TRUE(three);
  EXPECT_TRUE(std::equal(one.frame.raw.dn.data(), one.frame.raw.dn.data() + one.frame.raw.dn.size(),
                         three->frame.raw.dn.data()));
}

SignalElectrons ramp(int width, int height) {
  SignalElectrons out{Plane<float>(width, height), BayerPhase::rggb};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.value.at(x, y) = static_cast<float>(x - 4);
  }
  return out;
}

std::array<Plane<float>, 3> variances(const SignalElectrons& signal, double scale, double offset_e2) {
  std::array<Plane<float>, 3> out;
  for (auto& plane : out) {
    plane = Plane<float>(signal.value.width() / 2, signal.value.height() / 2);
    for (int y = 0; y < plane.height(); ++y) {
      for (int x = 0; x < plane.width(); ++x) {
        plane.at(x, y) = static_cast<float>(scale * std::max(0.0f, signal.value.at(2 * x, y)) + offset_e2);
      }
    }
  }
  return out;
}

TEST(ResidualProfile, FindsTheLineItIsGiven) {
  SignalElectrons signal = ramp(200, 64);
  const PerSite<double> electrons{1000, 1000, 1000, 1000};
  const auto profile = residual_profile(signal, variances(signal, 0.05, 2), electrons, 1e-8);
  // Green sites lie a pixel beside those the variances were made for: half an electron on average, 0.025 e-^2.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(profile.scale[c], 0.05 / 1000, 0.02 * 0.05 / 1000) << c;
    EXPECT_NEAR(profile.offset[c], 2e-6 + 1e-8, 0.05e-6) << c;
  }
}

TEST(ResidualProfile, IsTheMeanOfVariancesThatScatterAndOfAFewMuchSmallerOnes) {
  SignalElectrons signal = ramp(200, 64);
  const PerSite<double> electrons{1000, 1000, 1000, 1000};
  auto scattered = variances(signal, 0.05, 2);
  for (auto& plane : scattered) {
    for (int y = 0; y < plane.height(); ++y) {
      for (int x = 0; x < plane.width(); ++x) plane.at(x, y) *= (x + y) % 2 == 0 ? 0.2F : 1.8F;
    }
  }
  const auto mean = residual_profile(signal, scattered, electrons, 0);
  auto with_quiet_row = variances(signal, 0.05, 2);
  for (auto& plane : with_quiet_row) {
    for (int x = 0; x < plane.width(); ++x) plane.at(x, 7) *= 1e-4F;
  }
  const auto drawn = residual_profile(signal, with_quiet_row, electrons, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(mean.scale[c], 0.05 / 1000, 0.03 * 0.05 / 1000) << c;
    EXPECT_NEAR(mean.offset[c], 2e-6, 0.1e-6) << c;
    EXPECT_NEAR(drawn.scale[c], (1 - 1.0 / 32) * 0.05 / 1000, 0.02 * 0.05 / 1000) << c;  // one of 32 rows
    EXPECT_NEAR(drawn.offset[c], (1 - 1.0 / 32) * 2e-6, 0.1e-6) << c;
  }
}

TEST(ResidualProfile, NeverFallsAndNeverStartsBelowZero) {
  SignalElectrons signal = ramp(200, 64);
  const PerSite<double> electrons{1000, 1000, 1000, 1000};
  auto falling = variances(signal, 0, 2);
  for (auto& plane : falling) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] -= 0.02f * static_cast<float>(i % 100) * 0.9f;
  }
  const auto flat_line = residual_profile(signal, falling, electrons, 0);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(flat_line.scale[c], 1e-9, 1e-15);
    EXPECT_GT(flat_line.offset[c], 0);
  }
  SignalElectrons empty{Plane<float>(2, 2), BayerPhase::rggb};
  std::fill_n(empty.value.data(), 4, 0.0f);
  const auto nothing = residual_profile(empty, variances(empty, 0, 0), electrons, 0);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(nothing.offset[c], 0);
}

}  // namespace
}  // namespace lowlux::isp::clean_raw_test
