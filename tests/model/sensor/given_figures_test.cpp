#include "isp/model/sensor/given_figures.h"

#include <gtest/gtest.h>

#include <string>

namespace lowlux::isp {
namespace {

// The D850 has no dark current in the table and no quantum efficiency; the HWK4123 has both.
Result<void> check(const SensorFigures& given, const char* name = "ELD_NikonD850", const Optics& optics = {}) {
  const auto sensor = sensor_named(name, "", given);
  if (!sensor) return tl::make_unexpected(sensor.error());
  return check_given_figures(given, *sensor, optics);
}

void expect_refused(const SensorFigures& given, const std::string& words) {
  const auto checked = check(given);
  ASSERT_FALSE(checked) << words;
  EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(checked.error().message.starts_with(words)) << checked.error().message;
  EXPECT_EQ(checked.error().where, "ELD_NikonD850");
}

TEST(GivenFigures, NothingGivenIsRight) { EXPECT_TRUE(check({})); }

TEST(GivenFigures, HotPixelsNeedTheirCurrentAndTheOtherWayRound) {
  SensorFigures given;
  given.hot_pixel_fraction = 1e-3;
  expect_refused(given, "--hot-pixels does nothing without --hot-current");
  given.hot_pixel_current_e_per_s = 0;
  expect_refused(given, "--hot-pixels does nothing without --hot-current");
  given.hot_pixel_current_e_per_s = 50;
  EXPECT_TRUE(check(given));
  given.hot_pixel_fraction = std::nullopt;
  expect_refused(given, "--hot-current does nothing without --hot-pixels");
  given.hot_pixel_current_e_per_s = std::nullopt;
  given.hot_pixel_fraction = 0;
  EXPECT_TRUE(check(given)) << "it says that there are none";
}

TEST(GivenFigures, PlaceAndLengthOfTheGlowNeedAGlow) {
  SensorFigures position, length;
  position.glow_position = {0, 0.5};
  length.glow_length = 0.2;
  expect_refused(position, "--glow-position does nothing without --glow");
  expect_refused(length, "--glow-length does nothing without --glow");
  for (SensorFigures given : {position, length}) {
    given.glow_e_per_s = 1;
    EXPECT_TRUE(check(given));
  }
}

TEST(GivenFigures, WhatMultipliesDarkCurrentNeedsDarkCurrent) {
  SensorFigures dsnu, temperature, doubling;
  dsnu.dsnu = 0.1;
  temperature.dark_temperature_c = 5;
  doubling.dark_doubling_c = 6;
  expect_refused(dsnu, "--dsnu does nothing without --dark-current");
  expect_refused(temperature, "--dark-temperature does nothing without --dark-current");
  expect_refused(doubling, "--dark-doubling does nothing without --dark-current");
  for (SensorFigures given : {dsnu, temperature, doubling}) {
    EXPECT_TRUE(check(given, "HWK4123_low_gain"));
    given.dark_current_e_per_s = {0, 0, 0};
    EXPECT_FALSE(check(given, "HWK4123_low_gain"));
    given.dark_current_e_per_s = {0, 0.5, 0};
    EXPECT_TRUE(check(given));
  }
  SensorFigures activation, floor;
  activation.dark_activation_ev = 0.6;
  floor.dark_floor_e_per_s = 0.1;
  expect_refused(activation, "--dark-activation does nothing without --dark-current");
  expect_refused(floor, "--dark-floor does nothing without --dark-current");
  activation.dark_current_e_per_s = {1, 1, 1};
  EXPECT_TRUE(check(activation));
  activation.dark_doubling_c = 6;
  expect_refused(activation, "--dark-doubling does nothing without --dark-activation 0");
  dsnu.dsnu = 0;
  EXPECT_TRUE(check(dsnu)) << "it says that there is none";
}

TEST(GivenFigures, APixelPitchNeedsAnEfficiencyUnlessTheLuminanceThatFillsAPixelIsGiven) {
  SensorFigures given;
  given.pixel_pitch_um = 4;
  expect_refused(given, "--pixel-pitch does nothing without --peak-qe");
  EXPECT_TRUE(check(given, "ELD_NikonD850", {2, 10.0}));
  EXPECT_TRUE(check(given, "HWK4123_low_gain"));
  EXPECT_FALSE(check(given, "thesis")) << "its scale is its own";
  given.peak_quantum_efficiency = 0.5;
  EXPECT_TRUE(check(given));
}

TEST(GivenFigures, AnIsoSpeedContradictsTheLuminanceThatFillsAPixel) {
  SensorFigures given;
  given.iso = 100;
  EXPECT_TRUE(check(given));
  const auto checked = check(given, "ELD_NikonD850", {2, 10.0});
  ASSERT_FALSE(checked);
  EXPECT_TRUE(checked.error().message.starts_with("--iso does nothing with --white-luminance"))
      << checked.error().message;
  EXPECT_TRUE(check({}, "ELD_NikonD850", {2, 10.0})) << "the ISO speed of the table is replaced";
}

}  // namespace
}  // namespace lowlux::isp
