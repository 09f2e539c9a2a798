#include "isp/model/sensor/sensor_db.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "isp/model/sensor/noise_budget.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {
namespace {

bool assumes(const NamedSensor& sensor, std::string_view part) {
  return std::any_of(sensor.assumptions.begin(), sensor.assumptions.end(),
                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

TEST(SensorDb, NamesEachSensorOnceTheThesisFirst) {
  const auto names = sensor_names();
  ASSERT_FALSE(names.empty());
  EXPECT_EQ(names.front(), thesis_sensor);
  EXPECT_EQ(std::set<std::string_view>(names.begin(), names.end()).size(), names.size());
  for (const std::string_view name : names) EXPECT_FALSE(gain_settings(name).empty()) << name;
  EXPECT_TRUE(gain_settings("no such sensor").empty());
}

TEST(SensorDb, TheThesisSensorIsThatOfItsTable) {
  const auto sensor = sensor_named("thesis", "", {});
  ASSERT_TRUE(sensor);
  const SensorModel& m = sensor->model;
  EXPECT_EQ(m.system_gain_dn_per_e, 0.028334);
  EXPECT_EQ(m.read_noise_e, 4);
  EXPECT_EQ(m.full_well_e, 9000);
  EXPECT_EQ(m.bits, 8);
  EXPECT_EQ(m.black_level_dn, 0);
  EXPECT_EQ(m.white_level_dn, 255);
  EXPECT_EQ(m.dark_current_e_per_s, (std::array<double, 3>{195, 230, 218}));
  EXPECT_EQ(m.dark_temperature_c, 20);
  EXPECT_EQ(m.quantisation, Quantisation::floor);
  EXPECT_EQ(sensor->camera, "Sony_DXC-930");
  EXPECT_NEAR(m.full_well_e * m.system_gain_dn_per_e, 255, 0.05);
  EXPECT_TRUE(assumes(*sensor, "doubles every 7 C"));
  EXPECT_TRUE(assumes(*sensor, "no PRNU"));
  EXPECT_FALSE(assumes(*sensor, "full well"));
  EXPECT_FALSE(assumes(*sensor, "colours"));
}

TEST(SensorDb, WhatIsNotSourcedIsAnAssumptionThatSaysSo) {
  const auto sensor = sensor_named("ELD_NikonD850", "ISO 1600", {});
  ASSERT_TRUE(sensor);
  const SensorModel& m = sensor->model;
  EXPECT_EQ(m.system_gain_dn_per_e, 6.641);
  EXPECT_EQ(m.read_noise_e, 0.973);
  EXPECT_EQ(m.black_level_dn, 1024) << "a sixteenth of the range";
  EXPECT_EQ(m.white_level_dn, 16383);
  EXPECT_DOUBLE_EQ(m.full_well_e, (16383 - 1024) / 6.641);
  EXPECT_DOUBLE_EQ(m.row_noise_e, 0.058297);
  EXPECT_EQ(sensor->iso, 1600);
  EXPECT_FALSE(sensor->iso_given);
  EXPECT_TRUE(assumes(*sensor, "black level 1024 DN"));
  EXPECT_TRUE(assumes(*sensor, "full well"));
  EXPECT_TRUE(assumes(*sensor, "no dark current"));
  EXPECT_FALSE(assumes(*sensor, "row noise"));
  EXPECT_EQ(m.quantisation, Quantisation::round);
}

TEST(SensorDb, FiguresGivenTakeThePlaceOfTheTablesAndOfAssumptions) {
  SensorFigures given;
  given.system_gain_dn_per_e = 2;
  given.read_noise_e = 1.5;
  given.full_well_e = 1234;
  given.bits = 12;
  given.black_level_dn = 60;
  given.white_level_dn = 4000;
  given.dark_current_e_per_s = {1, 2, 3};
  given.dark_temperature_c = 5;
  given.dark_doubling_c = 6;
  given.prnu = 0.01;
  given.dsnu = 0.02;
  given.hot_pixel_fraction = 0.03;
  given.hot_pixel_current_e_per_s = 40;
  given.telegraph_fraction = 0.04;
  given.telegraph_e = 8;
  given.crosstalk = 0.015;
  given.glow_e_per_s = 9;
  given.glow_position = {0.25, 0.75};
  given.glow_length = 0.3;
  given.row_noise_e = 0.5;
  given.column_noise_e = 0.6;
  given.pixel_pitch_um = 3.3;
  given.peak_quantum_efficiency = 0.7;
  given.iso = 333;
  given.quantisation = Quantisation::floor;
  given.camera = "Canon_EOS_600D";
  const auto sensor = sensor_named("ELD_NikonD850", "ISO 100", given);
  ASSERT_TRUE(sensor);
  const SensorModel& m = sensor->model;
  EXPECT_EQ(m.system_gain_dn_per_e, 2);
  EXPECT_EQ(m.read_noise_e, 1.5);
  EXPECT_EQ(m.full_well_e, 1234);
  EXPECT_EQ(m.bits, 12);
  EXPECT_EQ(m.black_level_dn, 60);
  EXPECT_EQ(m.white_level_dn, 4000);
  EXPECT_EQ(m.dark_current_e_per_s, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(m.dark_temperature_c, 5);
  EXPECT_EQ(m.dark_doubling_c, 6);
  EXPECT_EQ(m.dark_activation_ev, 0);
  EXPECT_EQ(m.dark_floor_e_per_s, 0);
  EXPECT_EQ(m.prnu, 0.01);
  EXPECT_EQ(m.dsnu, 0.02);
  EXPECT_EQ(m.hot_pixel_fraction, 0.03);
  EXPECT_EQ(m.hot_pixel_current_e_per_s, 40);
  EXPECT_EQ(m.telegraph_fraction, 0.04);
  EXPECT_EQ(m.telegraph_e, 8);
  EXPECT_EQ(m.crosstalk, 0.015);
  EXPECT_EQ(m.glow_e_per_s, 9);
  EXPECT_EQ(m.glow_position, (std::array<double, 2>{0.25, 0.75}));
  EXPECT_EQ(m.glow_length, 0.3);
  EXPECT_EQ(m.row_noise_e, 0.5);
  EXPECT_EQ(m.column_noise_e, 0.6);
  EXPECT_EQ(m.quantisation, Quantisation::floor);
  EXPECT_EQ(sensor->pixel_pitch_um, 3.3);
  EXPECT_EQ(sensor->peak_quantum_efficiency, 0.7);
  EXPECT_EQ(sensor->iso, 333);
  EXPECT_TRUE(sensor->iso_given);
  EXPECT_EQ(sensor->camera, "Canon_EOS_600D");
  EXPECT_TRUE(sensor->assumptions.empty()) << sensor->assumptions.front();
}

TEST(SensorDb, AnActivationEnergyLeavesNothingToAssumeOfTheDoubling) {
  SensorFigures given;
  given.dark_current_e_per_s = {1, 2, 3};
  EXPECT_TRUE(assumes(*sensor_named("ELD_NikonD850", "ISO 100", given), "doubles every 7 C"));
  given.dark_activation_ev = 0.6;
  given.dark_floor_e_per_s = 0.5;
  const auto sensor = sensor_named("ELD_NikonD850", "ISO 100", given);
  ASSERT_TRUE(sensor);
  EXPECT_FALSE(assumes(*sensor, "doubles"));
  EXPECT_EQ(sensor->model.dark_activation_ev, 0.6);
  EXPECT_EQ(sensor->model.dark_floor_e_per_s, 0.5);
}

TEST(SensorDb, SettingsAreFoundByTheirNumberInAnyCase) {
  EXPECT_EQ(sensor_named("ELD_NikonD850", "1600", {})->gain_setting, "ISO 1600");
  EXPECT_EQ(sensor_named("ELD_NikonD850", "iso 1600", {})->gain_setting, "ISO 1600");
  EXPECT_EQ(sensor_named("ELD_NikonD850", "", {})->gain_setting, gain_settings("ELD_NikonD850").front());
  EXPECT_FALSE(sensor_named("ELD_NikonD850", "16", {})) << "part of a number is none";
  EXPECT_FALSE(sensor_named("ELD_NikonD850", "600", {}));
  EXPECT_EQ(sensor_named("ZWO_ASI294MC_Pro", "120", {})->gain_setting, "gain 120 (0.1 dB units)");
}

TEST(SensorDb, TheThesisSensorHasOneSettingAndNoOther) {
  for (const char* gain : {"", "G=141.67", "141.67"}) EXPECT_TRUE(sensor_named("thesis", gain, {})) << gain;
  for (const char* gain : {"99", "141", "1.67"}) {
    const auto refused = sensor_named("thesis", gain, {});
    ASSERT_FALSE(refused) << gain;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(refused.error().message.find("but for G=141.67"), std::string::npos) << refused.error().message;
  }
}

TEST(SensorDb, ColoursAreAnAssumptionUnlessTheyAreTheSensorsOwnOrChosen) {
  EXPECT_TRUE(assumes(*sensor_named("HWK4123_low_gain", "", {}), "the colours of a Nikon_D5100"));
  SensorFigures chosen;
  chosen.camera = "Nikon_D5100";
  const auto sensor = sensor_named("HWK4123_low_gain", "", chosen);
  ASSERT_TRUE(sensor);
  EXPECT_EQ(sensor->camera, "Nikon_D5100");
  EXPECT_FALSE(assumes(*sensor, "colours"));
}

TEST(SensorDb, DarkCurrentOfTheTableHasItsOwnTemperatureAndDoubling) {
  const auto sensor = sensor_named("HWK4123_low_gain", "", {});
  ASSERT_TRUE(sensor);
  EXPECT_EQ(sensor->model.dark_current_e_per_s, (std::array<double, 3>{0.1, 0.1, 0.1}));
  EXPECT_EQ(sensor->model.dark_temperature_c, 0);
  EXPECT_EQ(sensor->model.dark_doubling_c, 8.56);
  EXPECT_FALSE(assumes(*sensor, "doubles"));
  EXPECT_FALSE(assumes(*sensor, "at 20 C"));
}

TEST(SensorDb, OwnCamerasAreThoseOfSensorsWithoutAStandIn) {
  EXPECT_EQ(own_camera("ELD_NikonD850"), "Nikon_D850");
  EXPECT_EQ(own_camera("ELD_CanonEOS70D"), "") << "the colours of an EOS 600D stand in";
  EXPECT_EQ(own_camera("QSI_532"), "");
  EXPECT_EQ(own_camera("no such sensor"), "");
}

TEST(SensorDb, UnknownNamesAndSettingsAreAnsweredWithWhatThereIs) {
  const auto near = sensor_named("ELD_NikonD580", "", {});
  ASSERT_FALSE(near);
  EXPECT_EQ(near.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(near.error().message.find("ELD_NikonD850"), std::string::npos) << near.error().message;
  const auto far = sensor_named("?", "", {});
  ASSERT_FALSE(far);
  EXPECT_NE(far.error().message.find("thesis"), std::string::npos) << "the whole list";
  const auto setting = sensor_named("ELD_NikonD850", "ISO 12345", {});
  ASSERT_FALSE(setting);
  EXPECT_EQ(setting.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(setting.error().message.find("ISO 1600"), std::string::npos);
}

TEST(SensorDb, FiguresWithoutWhichNothingCanBeSimulatedAreAskedFor) {
  const auto none = sensor_named("QHY600", "", {});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::insufficient);
  EXPECT_NE(none.error().message.find("--system-gain"), std::string::npos) << none.error().message;
  EXPECT_NE(none.error().message.find("--read-noise"), std::string::npos);
  EXPECT_EQ(none.error().message.find("--bits"), std::string::npos) << "those are known";
  SensorFigures given;
  given.system_gain_dn_per_e = 1;
  given.read_noise_e = 2;
  EXPECT_TRUE(sensor_named("QHY600", "", given));
}

bool simulates(std::string_view name, std::string_view gain, const SensorFigures& figures) {
  const auto sensor = sensor_named(name, gain, figures);
  return sensor && spectral_response(*sensor, {});
}

TEST(SensorDb, TheOptionsNeededAreThoseThatMakeASensorComplete) {
  int needing = 0;
  for (const std::string_view name : sensor_names()) {
    for (const std::string_view gain : gain_settings(name)) {
      const auto options = options_needed(name, gain);
      EXPECT_EQ(simulates(name, gain, {}), options.empty()) << name << " " << gain;
      SensorFigures given;
      const auto give = [&](std::string_view option, auto& figure, auto value) {
        if (std::find(options.begin(), options.end(), option) != options.end()) figure = value;
      };
      give("--bits", given.bits, 12);
      give("--system-gain", given.system_gain_dn_per_e, 1.0);
      give("--read-noise", given.read_noise_e, 2.0);
      give("--pixel-pitch", given.pixel_pitch_um, 4.0);
      give("--peak-qe", given.peak_quantum_efficiency, 0.5);
      EXPECT_TRUE(simulates(name, gain, given)) << name << " " << gain;
      if (!options.empty()) ++needing;
    }
  }
  EXPECT_GT(needing, 0);
  EXPECT_EQ(options_needed("RaspberryPi_HQ", "analog gain 1"), std::vector<std::string_view>{"--peak-qe"});
  EXPECT_EQ(options_needed("ZWO_ASI290MM", ""),
            (std::vector<std::string_view>{"--read-noise", "--pixel-pitch", "--peak-qe"}));
  EXPECT_TRUE(options_needed("thesis", "").empty());
  EXPECT_TRUE(options_needed("no such sensor", "").empty());
}

TEST(SensorDb, FiguresThatCannotBeAreRefused) {
  SensorFigures given;
  given.read_noise_e = -1;
  EXPECT_FALSE(sensor_named("thesis", "", given));
  given = {};
  given.bits = 17;
  EXPECT_FALSE(sensor_named("thesis", "", given));
  given = {};
  given.bits = 1000;
  EXPECT_FALSE(sensor_named("thesis", "", given));
  given = {};
  given.white_level_dn = NAN;
  EXPECT_FALSE(sensor_named("thesis", "", given));
  given = {};
  given.black_level_dn = 255;
  EXPECT_FALSE(sensor_named("thesis", "", given));
}

TEST(SensorDb, EverySensorThatIsCompleteCanBeSimulated) {
  int complete = 0;
  for (const std::string_view name : sensor_names()) {
    for (const std::string_view setting : gain_settings(name)) {
      const auto sensor = sensor_named(name, setting, {});
      if (!sensor) {
        EXPECT_EQ(sensor.error().code, ErrorCode::insufficient) << name << " " << setting << sensor.error().message;
        continue;
      }
      ++complete;
      EXPECT_TRUE(check_sensor(sensor->model)) << name;
      EXPECT_EQ(sensor->gain_setting, setting);
      EXPECT_FALSE(sensor->source.empty());
      EXPECT_TRUE(camera_sensitivity(sensor->camera)) << sensor->camera;
    }
  }
  EXPECT_GE(complete, 30);
}

}  // namespace
}  // namespace lowlux::isp
