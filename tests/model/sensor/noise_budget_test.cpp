#include "isp/model/sensor/noise_budget.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

SensorModel good_sensor() {
  SensorModel s;
  s.name = "test";
  s.full_well_e = 9000;
  s.black_level_dn = 256;
  return s;
}

TEST(NoiseBudget, OfTheThesisSensorAtATenthOfACandelaIsTheSumByHand) {
  SensorModel sensor;
  sensor.system_gain_dn_per_e = 0.028334;
  sensor.read_noise_e = 4;
  // 9 e- of signal, 215 e- of dark charge: 0.028334^2 (9 + 215 + 16) + 1/12
  EXPECT_NEAR(variance_dn2(sensor, {9, 215}), 0.00080281556 * 240 + 1.0 / 12, 1e-8);  // digits of the square
  EXPECT_NEAR(snr(sensor, {9, 215}), 0.00080281556 * 81 / (0.00080281556 * 240 + 1.0 / 12), 1e-7);
}

TEST(NoiseBudget, WithoutChargeAndReadNoiseOnlyQuantisationIsLeft) {
  EXPECT_DOUBLE_EQ(variance_dn2({}, {}), 1.0 / 12);
  EXPECT_EQ(snr({}, {0, 100}), 0);
}

TEST(NoiseBudget, BrightLightHasTheSignalAsItsPowerRatio) {
  SensorModel sensor;
  sensor.read_noise_e = 2;
  EXPECT_NEAR(snr(sensor, {1e8, 0}) / 1e8, 1, 1e-7);  // (mu^2) / (mu + 4 + 1/12)
}

TEST(NoiseBudget, DarkCurrentDoublesWithEveryDoublingTemperature) {
  SensorModel s = good_sensor();
  s.dark_temperature_c = -10;
  s.dark_doubling_c = 8;
  s.dark_current_e_per_s = {3, 5, 7};
  EXPECT_EQ(dark_current_factor(s, -10), 1);
  EXPECT_EQ(dark_current_factor(s, -2), 2);
  EXPECT_EQ(dark_current_factor(s, -34), 0.125);
  EXPECT_DOUBLE_EQ(dark_current_factor(s, -6), std::sqrt(2.0));
  EXPECT_EQ(dark_mean_e(s, {0.5, -2}), (std::array<double, 3>{3, 5, 7}));
  EXPECT_EQ(dark_mean_e(s, {0, 60}), (std::array<double, 3>{0, 0, 0}));
}

TEST(NoiseBudget, DarkCurrentAboveItsFloorFollowsArrhenius) {
  SensorModel s = good_sensor();
  s.dark_current_e_per_s = {3, 5, 7};
  s.dark_activation_ev = 0.6;
  EXPECT_EQ(dark_current_factor(s, 20), 1);
  // E_a / k = 6962.7109 K from CODATA 2018; 20 to 30 C and 20 to -40 C.
  EXPECT_NEAR(dark_current_factor(s, 30), std::exp(6962.7109 * (1 / 293.15 - 1 / 303.15)), 1e-7);
  EXPECT_NEAR(dark_current_factor(s, -40), std::exp(6962.7109 * (1 / 293.15 - 1 / 233.15)), 1e-8);
  // The product of the factors of two steps is that of both.
  SensorModel at_30 = s;
  at_30.dark_temperature_c = 30;
  EXPECT_NEAR(dark_current_factor(s, 30) * dark_current_factor(at_30, 55) / dark_current_factor(s, 55), 1, 1e-14);
  s.dark_floor_e_per_s = 3;
  const auto warm = dark_mean_e(s, {2, 30});
  EXPECT_EQ(warm[0], 6) << "red is at its floor";
  EXPECT_NEAR(warm[1], 6 + 4 * dark_current_factor(s, 30), 1e-12);
  EXPECT_NEAR(warm[2], 6 + 8 * dark_current_factor(s, 30), 1e-12);
  for (const double mean_e : dark_mean_e(s, {2, -100})) EXPECT_NEAR(mean_e, 6, 1e-5);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(dark_mean_e(s, {1, 20})[k], s.dark_current_e_per_s[k]);
}

TEST(NoiseBudget, ThePixelSaturatesAtTheLesserOfFullWellAndConverter) {
  SensorModel s = good_sensor();
  EXPECT_EQ(saturation_charge_e(s), 4095 - 256);
  s.system_gain_dn_per_e = 0.25;
  EXPECT_EQ(saturation_charge_e(s), 9000);
}

struct Figure {
  const char* name;
  double SensorModel::*member;
  std::vector<double> good, bad;
};

TEST(CheckSensor, PassesBothEndsOfEveryRangeAndNothingBeyond) {
  const std::vector<double> good_noise{0, 1e-300, 1e6}, bad_noise{-1e-300, 1.0000001e6, nan, inf, -inf};
  const std::vector<double> good_current{0, 1e-300, 1e9}, bad_current{-1e-300, 1.0000001e9, nan, inf, -inf};
  const std::vector<double> good_fraction{0, 1}, bad_fraction{-1e-9, 1.0000001, nan, inf};
  const Figure figures[] = {
      {"system gain", &SensorModel::system_gain_dn_per_e, {1e-300, 1e6}, {0, -1, 1.0000001e6, nan, inf}},
      {"read noise", &SensorModel::read_noise_e, good_noise, bad_noise},
      {"full well", &SensorModel::full_well_e, {1e-300, largest_full_well_e}, {0, -1, 990001, nan, inf}},
      {"black level", &SensorModel::black_level_dn, {0, 4094.999}, {-1e-9, 4095, 5000, nan, inf, -inf}},
      {"white level", &SensorModel::white_level_dn, {257, 4095}, {256, 100, 4094.5, 4095.001, nan, inf, -inf}},
      {"dark temperature", &SensorModel::dark_temperature_c, {-200, 200}, {-200.1, 200.1, nan, inf}},
      {"dark doubling", &SensorModel::dark_doubling_c, {1, 1000}, {0.999, 1000.1, 0, -7, nan, inf}},
      {"dark activation", &SensorModel::dark_activation_ev, {0, 0.01, 2}, {0.009, 2.001, -0.6, nan, inf, -inf}},
      {"dark floor", &SensorModel::dark_floor_e_per_s, {0}, {-1e-300, 1e-300, nan, inf, -inf}},
      {"prnu", &SensorModel::prnu, good_fraction, bad_fraction},
      {"dsnu", &SensorModel::dsnu, good_fraction, bad_fraction},
      {"hot pixel fraction", &SensorModel::hot_pixel_fraction, good_fraction, bad_fraction},
      {"hot pixel current", &SensorModel::hot_pixel_current_e_per_s, good_current, bad_current},
      {"telegraph fraction", &SensorModel::telegraph_fraction, good_fraction, bad_fraction},
      {"telegraph noise", &SensorModel::telegraph_e, good_noise, bad_noise},
      {"crosstalk", &SensorModel::crosstalk, {0, 0.2}, {-1e-300, 0.2001, 1, nan, inf, -inf}},
      {"glow", &SensorModel::glow_e_per_s, {0, 1e6}, {-1e-300, 1.0000001e6, nan, inf, -inf}},
      {"glow length", &SensorModel::glow_length, {0.001, 10}, {0, 0.0009, 10.001, nan, inf, -inf}},
      {"row noise", &SensorModel::row_noise_e, good_noise, bad_noise},
      {"column noise", &SensorModel::column_noise_e, good_noise, bad_noise},
  };
  for (const Figure& figure : figures) {
    for (const double value : figure.good) {
      SensorModel s = good_sensor();
      s.*figure.member = value;
      EXPECT_TRUE(check_sensor(s)) << figure.name << " " << value;
    }
    for (const double value : figure.bad) {
      SensorModel s = good_sensor();
      s.*figure.member = value;
      const auto checked = check_sensor(s);
      ASSERT_FALSE(checked) << figure.name << " " << value;
      EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
      EXPECT_EQ(checked.error().where, "test");
    }
  }
}

TEST(CheckSensor, LooksAtTheDarkCurrentOfEachChannelAndAtTheBits) {
  for (int channel = 0; channel < 3; ++channel) {
    for (const double value : {-1.0, nan, inf}) {
      SensorModel s = good_sensor();
      s.dark_current_e_per_s[channel] = value;
      EXPECT_FALSE(check_sensor(s)) << channel;
    }
  }
  for (const auto& [bits, possible] : {std::pair{0, false}, {1, true}, {16, true}, {17, false}, {-3, false}}) {
    SensorModel s = good_sensor();
    s.bits = bits;
    s.black_level_dn = 0;
    s.white_level_dn = 1;
    EXPECT_EQ(static_cast<bool>(check_sensor(s)), possible) << bits;
  }
}

TEST(CheckSensor, TheSourceOfTheGlowMayLieOutsideButNotFar) {
  for (const int axis : {0, 1}) {
    for (const auto& [part, possible] :
         {std::pair{-1.0, true}, {2.0, true}, {-1.001, false}, {2.001, false}, {nan, false}, {inf, false}}) {
      SensorModel s = good_sensor();
      s.glow_position[axis] = part;
      EXPECT_EQ(static_cast<bool>(check_sensor(s)), possible) << axis << " " << part;
    }
  }
}

TEST(CheckSensor, TheFloorIsNoMoreThanTheLeastDarkCurrent) {
  SensorModel s = good_sensor();
  s.dark_current_e_per_s = {3, 2, 5};
  s.dark_floor_e_per_s = 2;
  EXPECT_TRUE(check_sensor(s));
  s.dark_floor_e_per_s = 2.001;
  ASSERT_FALSE(check_sensor(s));
  EXPECT_NE(check_sensor(s).error().message.find("2 e-/s, found 2.001"), std::string::npos);
}

TEST(CheckSensor, NamesTheFaultAndTheValueFound) {
  const auto message = [](double SensorModel::*member, double value) {
    SensorModel s = good_sensor();
    s.*member = value;
    return check_sensor(s).error().message;
  };
  const auto expect_part = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect_part(message(&SensorModel::read_noise_e, -2), "found -2");
  expect_part(message(&SensorModel::row_noise_e, 2e6), "the row noise must lie between 0 and 1e6 e-, found 2e+06");
  expect_part(message(&SensorModel::white_level_dn, 4000.5), "whole number, found 4000.5");
  expect_part(message(&SensorModel::prnu, 3), "found 3");
  expect_part(message(&SensorModel::dark_temperature_c, 300), "temperature");
  expect_part(message(&SensorModel::dark_temperature_c, 300), "found 300");
  expect_part(message(&SensorModel::dark_doubling_c, 0.5), "found 0.5");
  expect_part(message(&SensorModel::white_level_dn, 5000), "found 256 and 5000");
}

TEST(CheckExposure, PassesBothEndsOfTimeAndTemperatureAndNothingBeyond) {
  for (const Exposure& good : {Exposure{0, 20}, {1e6, 20}, {1, -100}, {1, 150}}) EXPECT_TRUE(check_exposure(good));
  for (const Exposure& bad : {Exposure{-1e-300, 20},
                              {1.000001e6, 20},
                              {nan, 20},
                              {inf, 20},
                              {-inf, 20},
                              {1, -100.1},
                              {1, 150.1},
                              {1, nan},
                              {1, inf},
                              {1, -inf}}) {
    const auto checked = check_exposure(bad);
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
  }
}

TEST(SaturatedChannels, AreThoseThatReachTheConverterOrTheFullWell) {
  SensorModel s = good_sensor();
  s.read_noise_e = 4;
  using Flags = std::array<bool, 3>;
  EXPECT_EQ(saturated_channels(s, {4094, 4095, 100}), (Flags{false, true, false})) << "the converter's end";
  s.system_gain_dn_per_e = 0.1;  // the full well reads 256 + 900, its noise 0.4 DN
  EXPECT_EQ(saturated_channels(s, {1153, 1154, 1160}), (Flags{false, true, true}));
  s.row_noise_e = 300;  // 30 DN more
  EXPECT_EQ(saturated_channels(s, {1000, 1010, 256}), (Flags{false, true, false}));
  EXPECT_EQ(saturated_channels(s, {nan, 0, 0}), (Flags{true, false, false})) << "no code is no colour either";
}

}  // namespace
}  // namespace lowlux::isp
