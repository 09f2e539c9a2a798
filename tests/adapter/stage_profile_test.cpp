#include "isp/adapter/stage_profile.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "calib/profile/profile_io.h"
#include "calib/profile/profile_use.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

GainProfile gain_at(double iso, double gain_dn_per_e, double read_noise_e, double pedestal_dn) {
  GainProfile out;
  out.iso = iso;
  out.sensor = SensorModel{.system_gain_dn_per_e = gain_dn_per_e,
                           .read_noise_e = read_noise_e,
                           .full_well_e = 3000,
                           .bits = 14,
                           .black_level_dn = pedestal_dn,
                           .white_level_dn = 16383,
                           .dark_current_e_per_s = {2, 4, 6},
                           .dark_temperature_c = 20,
                           .dark_doubling_c = 6};
  out.pedestal_dn.emplace();
  for (int site = 0; site < 4; ++site) (*out.pedestal_dn)[site] = {pedestal_dn + site, 0.3};
  out.dark_exposure_s = MeasuredRange{0, 10};
  out.dark_temperature_c = MeasuredRange{15, 30};
  return out;
}

CameraProfile made_up() {
  CameraProfile out;
  out.gains = {gain_at(100, 1, 4, 500), gain_at(430, 4, 2, 516), gain_at(1600, 17, 1.5, 520)};
  out.mosaic = "RGGB";
  return out;
}

constexpr RawFormat stream{.bits = 12, .phase = BayerPhase::rggb};

RawDn frame_of(const RawFormat& format, BayerPhase phase, double iso, double exposure_s, double temperature_c) {
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(16, 16);
  raw.active = raw.default_crop = {0, 0, 16, 16};
  raw.layout = format.layout;
  raw.phase = phase;
  raw.white_dn = {1e5, 1e5, 1e5};
  raw.info.iso = iso;
  raw.info.exposure_s = exposure_s;
  raw.info.temperature_c = temperature_c;
  return raw;
}

struct Setting {
  double analogue_gain;
  double exposure_s;
  double temperature_c;
};

/// The stage's figures against those of the profile's reader for one frame; a thousandth for what lies between the
/// points of the grid.
void expect_agreement(const CameraProfile& profile, const RawFormat& format, BayerPhase phase, const Setting& of) {
  auto stage = StageProfile::of(profile);
  ASSERT_TRUE(stage && stage->prepare(format, phase));
  const auto found = stage->at(of.analogue_gain, of.exposure_s, of.temperature_c);
  const RawDn frame = frame_of(format, phase, 100 * of.analogue_gain, of.exposure_s, of.temperature_c);
  const auto expected = calib::profile_at(profile, frame);
  ASSERT_TRUE(found && expected && expected->sensor);
  const SensorModel& sensor = *expected->sensor;
  const double codes = std::exp2(format.bits - sensor.bits);
  const auto near = [](double a, double b) { EXPECT_NEAR(a, b, 1e-3 * std::fabs(b)); };
  near(found->gain_dn_per_e, codes * sensor.system_gain_dn_per_e);
  near(found->read_noise_dn, codes * sensor.system_gain_dn_per_e * sensor.read_noise_e);
  ASSERT_EQ(found->pedestal_dn.has_value(), expected->black.has_value());
  for (int site = 0; site < 4; ++site) {
    near(found->dark_e[site], expected->dark_mean_e[site]);
    if (!found->pedestal_dn) continue;
    near((*found->pedestal_dn)[site] + found->gain_dn_per_e * found->dark_e[site],
         codes * expected->black->pedestal_dn[site]);
  }
}

TEST(StageProfile, AgreesWithTheProfileAtEverySetting) {
  for (const double gain : {0.3, 1.0, 1.3, 2.9, 4.3, 7.0, 12.0, 16.0, 40.0}) {
    for (const Setting& of : {Setting{gain, 0.04, 20}, Setting{gain, 0.5, 31}, Setting{gain, 8, -5}}) {
      for (const int bits : {8, 10, 12, 14, 16}) {
        expect_agreement(made_up(), {.bits = bits}, BayerPhase::rggb, of);
        expect_agreement(made_up(), {.bits = bits}, BayerPhase::gbrg, of);
      }
    }
  }
}

TEST(StageProfile, TakesDarkChargeAsTheProfilesReaderDoes) {
  CameraProfile in_pedestal = made_up(), no_temperature = made_up();
  for (GainProfile& gain : in_pedestal.gains) gain.pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
  for (GainProfile& gain : no_temperature.gains) gain.dark_temperature_c.reset();
  for (const CameraProfile& profile : {in_pedestal, no_temperature}) {
    expect_agreement(profile, stream, BayerPhase::rggb, {4.3, 2, 40});
  }
  auto stage = StageProfile::of(in_pedestal);
  ASSERT_TRUE(stage && stage->prepare(stream, BayerPhase::rggb));
  EXPECT_EQ(stage->at(1, 10, 60)->dark_e, (PerSite<double>{}));
}

TEST(StageProfile, AgreesWithTheProfilesThatComeWithLowlux) {
  for (const char* name : {"ELD_CanonEOS5D4", "ELD_SonyA7S2", "GSENSE4040BSI", "RaspberryPi_HQ", "QSI_532", "thesis"}) {
    const std::string file = std::string(LOWLUX_TESTDATA "/../calib/profiles/") + name + ".json";
    EXPECT_TRUE(StageProfile::read(file)) << name;
    std::ifstream in(file);
    const auto profile = calib::parse_profile(std::string(std::istreambuf_iterator<char>(in), {}));
    ASSERT_TRUE(profile) << name << ": " << profile.error().message;
    for (const double gain : {1.0, 5.7, 20.0}) {
      for (const Setting& of : {Setting{gain, 0.04, 20}, Setting{gain, 1, 35}}) {
        expect_agreement(*profile, {.bits = 10}, BayerPhase::rggb, of);
      }
    }
  }
}

TEST(StageProfile, WhatIsNotKnownIsGainOneWithoutDarkCharge) {
  auto stage = StageProfile::of(made_up());
  ASSERT_TRUE(stage && stage->prepare(stream, BayerPhase::rggb));
  const auto found = stage->at(std::nullopt, std::nullopt, std::nullopt);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->gain_dn_per_e, 0.25, 1e-12);  // 14 bits in 12
  EXPECT_EQ(found->dark_e, (PerSite<double>{}));
  EXPECT_NEAR(stage->at(1, 3, std::nullopt)->dark_e[1], 12, 1e-12);  // 3 s of 4 e-/s at the darks' temperature
}

// As `lowlux develop` takes a frame that states no ISO.
TEST(StageProfile, FramesWithoutGainHaveTheOnlySettingOfAProfile) {
  CameraProfile profile;
  profile.gains = {gain_at(800, 9, 1.5, 500)};
  auto stage = StageProfile::of(profile);
  ASSERT_TRUE(stage && stage->prepare(stream, BayerPhase::rggb));
  const auto found = stage->at(std::nullopt, std::nullopt, std::nullopt);
  RawDn frame = frame_of(stream, BayerPhase::rggb, 0, 0.01, 20);
  frame.info.iso.reset();
  const auto expected = calib::profile_at(profile, frame);
  ASSERT_TRUE(found && expected && expected->sensor);
  EXPECT_NEAR(found->gain_dn_per_e, expected->sensor->system_gain_dn_per_e / 4, 1e-9);
  EXPECT_NEAR(found->read_noise_dn, 1.5 * 9 / 4, 1e-9);
  EXPECT_NEAR(stage->at(1, std::nullopt, std::nullopt)->gain_dn_per_e, 9 / 4.0 / 8, 1e-3);
}

TEST(StageProfile, MonochromeStreamsHaveOneDarkCurrent) {
  CameraProfile profile = made_up();
  profile.mosaic = "monochrome";
  const RawFormat format{.bits = 14, .layout = SensorLayout::monochrome};
  expect_agreement(profile, format, BayerPhase::rggb, {2, 1, 26});
}

TEST(StageProfile, RefusesSensorsOfAnotherKindAndSettingsWithoutIso) {
  auto bayer = StageProfile::of(made_up());
  const auto mono = bayer->prepare({.bits = 10, .layout = SensorLayout::monochrome}, BayerPhase::rggb);
  ASSERT_FALSE(mono);
  EXPECT_EQ(mono.error().code, ErrorCode::malformed);
  CameraProfile of_mono = made_up();
  of_mono.mosaic = "monochrome";
  EXPECT_FALSE(StageProfile::of(of_mono)->prepare(stream, BayerPhase::rggb));
  CameraProfile without_iso = made_up();
  for (GainProfile& gain : without_iso.gains) gain.iso.reset();
  const auto unknown = StageProfile::of(without_iso)->prepare(stream, BayerPhase::rggb);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::insufficient);
  const auto missing = StageProfile::read(LOWLUX_TESTDATA "/no such profile.json");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::unreadable);
  const auto picture = StageProfile::read(LOWLUX_TESTDATA "/pictures/kodim05.png");
  ASSERT_FALSE(picture);
  EXPECT_NE(picture.error().where.find("kodim05"), std::string::npos);
}

TEST(StageProfile, OnlyRegularFilesAreProfiles) {
  const test::ScratchDirectory scratch;
  ASSERT_EQ(mkfifo(scratch.file("fifo").c_str(), 0600), 0);
  alarm(60);  // ends a program that waits for a writer
  for (const std::string& file : {scratch.file("fifo"), scratch.path(), std::string("/dev/null")}) {
    const auto read = StageProfile::read(file);
    ASSERT_FALSE(read) << file;
    EXPECT_EQ(read.error().code, ErrorCode::unreadable);
    EXPECT_EQ(read.error().message, "the profile is not a regular file");
  }
  alarm(0);
}

TEST(StageProfile, WithoutGainsInElectronsThereAreNoFigures) {
  auto empty = StageProfile::of(CameraProfile{});
  ASSERT_TRUE(empty->prepare(stream, BayerPhase::rggb));
  EXPECT_FALSE(empty->at(1, 0.04, 20));
  CameraProfile in_codes = made_up();
  for (GainProfile& gain : in_codes.gains) gain.sensor.reset();
  auto stage = StageProfile::of(in_codes);
  ASSERT_TRUE(stage->prepare(stream, BayerPhase::rggb));
  EXPECT_FALSE(stage->at(1, 0.04, 20));
  EXPECT_TRUE(stage->hot_pixels().empty());
}

TEST(StageProfile, ListsHotPixelsThatStandOutInAVideoFrameOnceAndInOrder) {
  CameraProfile profile = made_up();
  // Six read noises of 4, 2 and 1.5 e- in 0.04 s: 600, 300 and 225 e-/s.
  profile.gains[0].hot_pixels = {{7, 9, 601}, {3, 9, 599}, {1, 2, 5000}};
  profile.gains[1].hot_pixels = {{1, 2, 4000}, {5, 9, 299}};
  profile.gains[2].hot_pixels = {{0, 10, 226}, {9, 0, 224}};
  std::vector<std::pair<int, int>> places;
  for (const HotPixelFigure& hot : StageProfile::of(profile)->hot_pixels()) places.emplace_back(hot.x, hot.y);
  EXPECT_EQ(places, (std::vector<std::pair<int, int>>{{1, 2}, {7, 9}, {0, 10}}));
}

}  // namespace
}  // namespace lowlux::isp
