#include "isp/adapter/stage_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>

#include "calib/profile/profile_io.h"
#include "isp/base/camera_profile.h"
#include "isp/base/sensor.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::stage_exposure_test {
namespace {

using namespace stage_testing;

constexpr int width = 128, height = 96;

const RawFormatNames& names() { return names_of_bayer(12); }

/// A night scene whose exposure can be set: 2000 electrons per second, and lamps of fifty times as many.
Codes night(double exposure_s, double gain, std::mt19937& random, double dark_e_per_s = 0) {
  Codes out(width * height);
  std::normal_distribution<double> normal;
  const double dn_per_e = 0.1 * gain;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double e = exposure_s * ((x < 8 ? 1e5 : 2000) + dark_e_per_s);
      const double dn = 256 + dn_per_e * (e + std::sqrt(e + 9) * normal(random));
      out[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
          static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, 4095.0));
    }
  }
  return out;
}

lowlux_stage_params params_of(double exposure_s, double gain) {
  auto out = no_params();
  out.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_ANALOGUE_GAIN |
              LOWLUX_STAGE_HAS_EXPOSURE_LIMITS;
  std::ranges::fill(out.black_level, 256.0F);
  out.exposure_s = exposure_s;
  out.analogue_gain = static_cast<float>(gain);
  out.max_exposure_s = 0.2F;
  out.max_gain = 16;
  out.clipped_fraction = 0.01F;
  out.mains_hz = 50;
  return out;
}

TEST(StageExposure, AdvisesAnExposureAtWhichItStays) {
  std::printf("seed 7\n");
  std::mt19937 random(7);
  for (const double start_s : {0.0002, 0.01, 0.2}) {
    for (const double start_gain : {1.0, 16.0}) {
      Rig rig(plain_settings(), names(), width, height, LOWLUX_STAGE_BGR888);
      double exposure_s = start_s, gain = start_gain;
      int last_change = 0;
      for (int i = 0; i < 60; ++i) {
        ASSERT_EQ(rig.process(night(exposure_s, gain, random), params_of(exposure_s, gain)), LOWLUX_STAGE_OK);
        EXPECT_TRUE((rig.result.applied & LOWLUX_STAGE_HAS_EXPOSURE_LIMITS) != 0);
        if (std::abs(rig.result.advised_exposure_s - exposure_s) > 1e-6 ||
            std::abs(rig.result.advised_gain - gain) > 1e-6) {
          last_change = i;
        }
        exposure_s = rig.result.advised_exposure_s;
        gain = rig.result.advised_gain;
      }
      EXPECT_LT(last_change, 12);
      // Whole half periods of 50 Hz; the lamps fill the range, and no code clips.
      EXPECT_NEAR(exposure_s * 100, std::round(exposure_s * 100), 1e-4);
      EXPECT_GE(exposure_s, 0.01);
      const double lamp = 0.1 * gain * 1e5 * exposure_s / (4095 - 256);
      EXPECT_GT(lamp, 0.75);
      EXPECT_LT(lamp, 1);
      EXPECT_NE(rig.result.advised_limit, LOWLUX_STAGE_LIMIT_NONE);
      EXPECT_GT(rig.result.advised_snr_db, 0);
    }
  }
}

// A wall without a dark place: nothing states black, and each frame shows its own light as black.
TEST(StageExposure, SettlesWhereBlackIsNotKnownAndNothingIsBlack) {
  std::printf("seed 7\n");
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const double e_per_s : {3e4, 2e5, 2e6}) {
    Rig rig(plain_settings(), names(), width, height, LOWLUX_STAGE_BGR888);
    double exposure_s = 0.01, gain = 1;
    int last_change = 0;
    double clipped = 1;
    for (int i = 0; i < 60; ++i) {
      Codes codes(width * height);
      const double e = e_per_s * exposure_s;
      for (std::size_t p = 0; p < codes.size(); ++p) {
        const double light = e * (1 - 0.3 * static_cast<double>(p % width) / width);
        const double dn = 256 + 0.1 * gain * (light + std::sqrt(light + 9) * normal(random));
        codes[p] = static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, 4095.0));
      }
      auto params = params_of(exposure_s, gain);
      params.valid &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_BLACK);
      params.mains_hz = 0;
      ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
      if (std::abs(rig.result.advised_exposure_s / exposure_s - 1) > 1e-6 ||
          std::abs(rig.result.advised_gain - gain) > 1e-6) {
        last_change = i;
      }
      clipped = rig.statistics.clipped;
      exposure_s = rig.result.advised_exposure_s;
      gain = rig.result.advised_gain;
    }
    EXPECT_LT(last_change, 30) << e_per_s;
    EXPECT_LT(clipped, 0.01) << e_per_s;
  }
}

/// The sensor of night(), with a dark current.
CameraProfile profile_of_night(double dark_e_per_s) {
  CameraProfile out;
  out.mosaic = "RGGB";
  GainProfile& gain = out.gains.emplace_back();
  gain.gain_setting = "ISO";
  gain.iso = 100;
  gain.sensor = SensorModel{.system_gain_dn_per_e = 0.1, .read_noise_e = 3, .full_well_e = 38390};
  gain.sensor->black_level_dn = 256;
  gain.sensor->dark_current_e_per_s = {dark_e_per_s, dark_e_per_s, dark_e_per_s};
  gain.pedestal_dn.emplace();
  for (int site = 0; site < 4; ++site) (*gain.pedestal_dn)[site].value = 256;
  return out;
}

TEST(StageExposure, CountsDarkChargeOnce) {
  constexpr double dark_e_per_s = 4000, exposure_s = 0.05;
  const test::ScratchDirectory scratch;
  const auto text = calib::profile_text(profile_of_night(dark_e_per_s));
  ASSERT_TRUE(text) << text.error().message;
  scratch.write("camera.json", *text);
  const std::string file = scratch.file("camera.json");
  auto settings = plain_settings();
  settings.profile_file = file.c_str();
  std::mt19937 random(7);
  for (const bool states_black : {false, true}) {
    Rig rig(settings, names(), width, height, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << rig.error();
    auto params = params_of(exposure_s, 1);
    if (!states_black) params.valid &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_BLACK);
    params.max_exposure_s = static_cast<float>(exposure_s);
    params.max_gain = 1;
    params.mains_hz = 0;
    ASSERT_EQ(rig.process(night(exposure_s, 1, random, dark_e_per_s), params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_NEAR(rig.result.black_level[1], 256 + 0.1 * dark_e_per_s * exposure_s, 1e-3);
    EXPECT_NEAR(rig.result.advised_exposure_s, exposure_s, 1e-6);
    const double signal_e = 2000 * exposure_s, dark_e = dark_e_per_s * exposure_s;
    const double variance_e2 = signal_e + dark_e + 9 + quantisation_dn2 / 0.01;
    // Five standard errors of a median of 3072 pixels are 0.17 dB; lamps and whole codes move it by as much.
    EXPECT_NEAR(rig.result.advised_snr_db, 10 * std::log10(signal_e * signal_e / variance_e2), 0.5);
  }
}

TEST(StageExposure, NeedsLimitsExposureAndGain) {
  std::mt19937 random(7);
  for (const std::uint32_t bit :
       {LOWLUX_STAGE_HAS_EXPOSURE_LIMITS, LOWLUX_STAGE_HAS_EXPOSURE, LOWLUX_STAGE_HAS_ANALOGUE_GAIN}) {
    Rig rig(plain_settings(), names(), width, height, LOWLUX_STAGE_BGR888);
    auto params = params_of(0.01, 1);
    params.valid &= ~bit;
    ASSERT_EQ(rig.process(night(0.01, 1, random), params), LOWLUX_STAGE_OK);
    EXPECT_EQ(rig.result.advised_exposure_s, 0);
    EXPECT_EQ(rig.result.advised_gain, 0);
    EXPECT_EQ(rig.result.advised_limit, LOWLUX_STAGE_LIMIT_NONE);
    EXPECT_EQ(rig.result.applied & LOWLUX_STAGE_HAS_EXPOSURE_LIMITS, 0U);
  }
}

TEST(StageExposure, FollowsLimitsThatChange) {
  std::mt19937 random(7);
  Rig rig(plain_settings(), names(), width, height, LOWLUX_STAGE_BGR888);
  double exposure_s = 0.01, gain = 1;
  const auto run = [&](float max_s, float max_gain, std::int32_t mains) {
    for (int i = 0; i < 40; ++i) {
      auto params = params_of(exposure_s, gain);
      params.max_exposure_s = max_s;
      params.max_gain = max_gain;
      params.mains_hz = mains;
      ASSERT_EQ(rig.process(night(exposure_s, gain, random), params), LOWLUX_STAGE_OK);
      exposure_s = rig.result.advised_exposure_s;
      gain = rig.result.advised_gain;
    }
  };
  run(0.004F, 16, 0);
  EXPECT_NEAR(exposure_s, 0.004, 1e-6);
  EXPECT_GT(gain, 4);
  run(0.004F, 2, 0);
  EXPECT_LE(gain, 2);
  EXPECT_EQ(rig.result.advised_limit, LOWLUX_STAGE_LIMIT_TIME);
  run(0.2F, 16, 60);
  EXPECT_NEAR(exposure_s * 120, std::round(exposure_s * 120), 1e-4);
}

TEST(StageExposure, RefusesLimitsThatContradictThemselves) {
  using Set = void (*)(lowlux_stage_params&);
  const Set bad[] = {[](lowlux_stage_params& p) { p.max_exposure_s = 0; },
                     [](lowlux_stage_params& p) { p.max_exposure_s = NAN; },
                     [](lowlux_stage_params& p) { p.min_exposure_s = 0.3F; },
                     [](lowlux_stage_params& p) { p.min_exposure_s = -1; },
                     [](lowlux_stage_params& p) { p.max_gain = 0.5F; },
                     [](lowlux_stage_params& p) { p.max_gain = INFINITY; },
                     [](lowlux_stage_params& p) { p.clipped_fraction = 0.6F; },
                     [](lowlux_stage_params& p) { p.clipped_fraction = NAN; },
                     [](lowlux_stage_params& p) { p.mains_hz = 55; }};
  for (const Set& set : bad) {
    auto params = params_of(0.01, 1);
    ASSERT_EQ(isp::fault_of_limits(params), nullptr);
    set(params);
    EXPECT_NE(isp::fault_of_limits(params), nullptr);
  }
}

TEST(StageExposure, AcceptsLimitsAtTheEndsOfTheirRanges) {
  using Set = void (*)(lowlux_stage_params&);
  const Set good[] = {[](lowlux_stage_params& p) { p.max_exposure_s = 1e-7F; },
                      [](lowlux_stage_params& p) { p.max_exposure_s = 1e5F; },
                      [](lowlux_stage_params& p) { p.min_exposure_s = p.max_exposure_s; },
                      [](lowlux_stage_params& p) { p.max_gain = 1; },
                      [](lowlux_stage_params& p) { p.max_gain = 1e4F; },
                      [](lowlux_stage_params& p) { p.clipped_fraction = 1e-9F; },
                      [](lowlux_stage_params& p) { p.clipped_fraction = 0.5F; }};
  for (const Set& set : good) {
    auto params = params_of(0.01, 1);
    set(params);
    EXPECT_STREQ(isp::fault_of_limits(params), nullptr);
  }
}

// Callers compiled with the header before there was advice: 96 bytes of results, whose last ones are padding.
TEST(StageExposure, IsNotWrittenBeyondTheResultsOfEarlierCallers) {
  std::mt19937 random(7);
  Rig rig(plain_settings(), names(), width, height, LOWLUX_STAGE_BGR888);
  auto params = params_of(0.01, 1);
  params.valid &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_EXPOSURE_LIMITS);
  constexpr std::size_t earlier_params = offsetof(lowlux_stage_params, budget_ms) + 8;
  constexpr std::size_t earlier_result = offsetof(lowlux_stage_result, took_ms) + 8;
  static_assert(earlier_params % 8 == 0 && earlier_result % 8 == 0);
  params.size = earlier_params;
  std::memset(&params.max_exposure_s, 0xFF, 4);  // the padding of earlier callers
  std::memset(&rig.result, 0x77, sizeof rig.result);
  rig.result.size = earlier_result;
  ASSERT_EQ(rig.process(night(0.01, 1, random), params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_GT(rig.result.took_ms, 0);
  EXPECT_EQ(rig.result.advised_limit, 0x77777777);
  params.valid |= LOWLUX_STAGE_HAS_EXPOSURE_LIMITS;
  EXPECT_EQ(rig.process(night(0.01, 1, random), params), LOWLUX_STAGE_BAD_PARAMETER) << "limits that are not there";
}

}  // namespace
}  // namespace lowlux::stage_exposure_test
