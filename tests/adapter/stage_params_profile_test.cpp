#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "calib/profile/profile_io.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::stage_params_profile_test {
namespace {

using namespace stage_testing;

constexpr int width = 64, height = 48;

/// Two settings, ISO 100 and 400, measured in 12 bits.
std::string profile_file(const test::ScratchDirectory& scratch, const std::string& mosaic = "RGGB") {
  CameraProfile profile;
  profile.mosaic = mosaic;
  for (const double iso : {100.0, 400.0}) {
    GainProfile gain;
    gain.gain_setting = "ISO";
    gain.iso = iso;
    gain.sensor = SensorModel{.system_gain_dn_per_e = iso / 200, .read_noise_e = iso == 100 ? 4.0 : 2.0};
    gain.sensor->bits = 12;
    gain.sensor->black_level_dn = 240;
    gain.sensor->white_level_dn = 4095;
    gain.sensor->full_well_e = 8000;
    gain.sensor->dark_current_e_per_s = {1, 2, 3};
    gain.sensor->dark_temperature_c = 20;
    gain.sensor->dark_doubling_c = 6;
    gain.pedestal_dn.emplace();
    for (int site = 0; site < 4; ++site) (*gain.pedestal_dn)[site].value = 240 + site;
    profile.gains.push_back(gain);
  }
  const auto text = calib::profile_text(profile);
  EXPECT_TRUE(text) << text.error().message;
  scratch.write("camera.json", *text);
  return scratch.file("camera.json");
}

TEST(StageParamsWithProfile, OfGainExposureAndTemperatureSelectTheProfilesFigures) {
  const test::ScratchDirectory scratch;
  const std::string file = profile_file(scratch);
  auto settings = plain_settings();
  settings.profile_file = file.c_str();
  const RawFormatNames& names = names_of_bayer(10);  // a quarter of the profile's codes
  Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << rig.error();
  const Codes codes = scene(names.format, width, height);
  auto params = no_params();
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.result.noise_from, LOWLUX_STAGE_FROM_PROFILE);
  EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_PROFILE);
  const float relative = 1e-5F;  // floats in several steps
  EXPECT_NEAR(rig.result.noise_gain, 0.5 / 4, relative);
  EXPECT_NEAR(rig.result.noise_read, std::sqrt(0.125 * 0.125 * 16 + 1.0 / 12), relative);
  for (int site = 0; site < 4; ++site) EXPECT_NEAR(rig.result.black_level[site], (240 + site) / 4.0, 60 * relative);

  params.valid = LOWLUX_STAGE_HAS_ANALOGUE_GAIN | LOWLUX_STAGE_HAS_DIGITAL_GAIN;
  params.analogue_gain = 2;  // ISO 200, the middle in logarithms: 1 DN/e-, sqrt(8) e-
  params.digital_gain = 3;
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  EXPECT_NEAR(rig.result.noise_gain, 3 * 1.0 / 4, relative);
  EXPECT_NEAR(rig.result.noise_read, std::sqrt(9.0 / 16 * 8 + 1.0 / 12), relative);
  EXPECT_EQ(rig.result.applied, params.valid);

  params.valid = LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_TEMPERATURE;
  params.exposure_s = 5;
  params.temperature_c = 32;  // two doublings
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  const double dark_e[] = {20, 40, 40, 60};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(rig.result.black_level[i], (240 + i) / 4.0 + 0.125 * dark_e[i], 60 * relative) << i;
  }
  EXPECT_EQ(rig.result.applied, params.valid);

  params.exposure_s = 1e5;  // more charge than a pixel holds
  params.temperature_c = 200;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_BAD_PARAMETER);
}

TEST(StageParamsWithProfile, OfTheCallersGoBeforeTheProfiles) {
  const test::ScratchDirectory scratch;
  const std::string file = profile_file(scratch);
  auto settings = plain_settings();
  settings.profile_file = file.c_str();
  const RawFormatNames& names = names_of_bayer(12);
  Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(rig.process(scene(names.format, width, height), fixed_params(names.format)), LOWLUX_STAGE_OK);
  EXPECT_EQ(rig.result.noise_from, LOWLUX_STAGE_FROM_PARAMS);
  EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_PARAMS);
  EXPECT_EQ(rig.result.black_level[0], 256);
}

// No temperature is stated: dark charge would be that at the profile's 20 C. The masked pixels hold less, and more.
TEST(StageParamsWithProfile, NoiseFollowsFromTheDarkChargeOfMaskedPixels) {
  const test::ScratchDirectory scratch;
  const std::string file = profile_file(scratch);
  auto settings = plain_settings();
  settings.profile_file = file.c_str();
  const RawFormatNames& names = names_of_bayer(12);
  constexpr int masked = 8;  // rows
  auto in = input_of(names, width, height);
  in.masked = {0, 0, width, masked};
  in.crop = {0, masked, width, height - masked};
  Rig rig(settings, names, in, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << rig.error();
  auto params = no_params();
  params.valid = LOWLUX_STAGE_HAS_EXPOSURE;
  params.exposure_s = 20;  // 20, 40 and 60 e- at 20 C
  for (const double above_dn : {0.0, 2.0, 100.0, -3.0}) {
    Codes codes = scene(names.format, width, height);
    for (int i = 0; i < width * masked; ++i) {
      codes[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(240 + above_dn + site_of(i % width, i / width));
    }
    ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(rig.result.black_from, LOWLUX_STAGE_FROM_MASKED);
    // 0.5 DN/e-, 4 e- of read noise.
    EXPECT_NEAR(rig.result.noise_read, std::sqrt(0.5 * std::max(0.0, above_dn) + 4 + 1.0 / 12), 1e-4) << above_dn;
    EXPECT_NEAR(rig.result.noise_gain, 0.5, 1e-5);
  }
}

TEST(StageParamsWithProfile, WithoutAGainTheProfilesThatShipServeAllTheirMosaics) {
  for (const char* const name : {"RaspberryPi_HQ", "thesis", "QHY5III178"}) {
    const std::string file = std::string(LOWLUX_TESTDATA "/../calib/profiles/") + name + ".json";
    auto settings = plain_settings();
    settings.profile_file = file.c_str();
    const RawFormatNames& names = names_of_bayer(12);
    Rig rig(settings, names, width, height, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << name << ' ' << rig.error();
    ASSERT_EQ(rig.process(scene(names.format, width, height), no_params()), LOWLUX_STAGE_OK) << rig.error();
    EXPECT_EQ(rig.result.noise_from, LOWLUX_STAGE_FROM_PROFILE) << name;
  }
}

TEST(StageParamsWithProfile, AProfileOfAnotherKindOfSensorIsRefused) {
  const test::ScratchDirectory scratch;
  const std::string file = profile_file(scratch, "monochrome");
  auto settings = plain_settings();
  settings.profile_file = file.c_str();
  const Rig rig(settings, names_of_bayer(12), width, height, LOWLUX_STAGE_BGR888);
  EXPECT_EQ(rig.configured, LOWLUX_STAGE_BAD_PROFILE);
  EXPECT_NE(std::string(rig.error()).find("monochrome"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::stage_params_profile_test
