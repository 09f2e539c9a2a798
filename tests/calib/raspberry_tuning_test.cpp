#include "calib/noise/raspberry_tuning.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "calib/profile/profile_io.h"

namespace lowlux::calib {
namespace {

std::string tuning_of(const char* target, const char* constant, const char* slope, const char* black) {
  return fmt::format(
      R"({{"version": 2.0, "target": "{}", "algorithms": [ {{"rpi.black_level": {{"black_level": {}}}}},
      {{"rpi.noise": {{"reference_constant": {}, "reference_slope": {}}}}} ]}})",
      target, black, constant, slope);
}

TEST(RaspberryTuning, IsReadInBothVersions) {
  const auto two = parse_raspberry_tuning(tuning_of("pisp", "17", "4.8", "3840"));
  ASSERT_TRUE(two) << two.error().message;
  EXPECT_EQ(two->reference_constant, 17);
  EXPECT_EQ(two->reference_slope, 4.8);
  EXPECT_EQ(two->black_level, 3840);
  EXPECT_EQ(two->target, "pisp");
  const auto one = parse_raspberry_tuning(
      R"({"rpi.black_level": {"black_level": 4096}, "rpi.noise": {"reference_constant": 0, "reference_slope": 2.5}})");
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->reference_slope, 2.5);
  EXPECT_EQ(one->target, "");
}

TEST(RaspberryTuning, RefusesWhatStatesNoNoise) {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  for (const std::string& json :
       {std::string(), std::string("{}"), std::string("nonsense"), deep, tuning_of("pisp", "0", "0", "4096"),
        tuning_of("pisp", "0", "-1", "4096"), tuning_of("pisp", "0", "100", "4096"),
        tuning_of("pisp", "-1", "2", "4096"), tuning_of("pisp", "1001", "2", "4096"), tuning_of("pisp", "0", "2", "-1"),
        tuning_of("pisp", "0", "2", "32768"), tuning_of("pisp", "0", "NaN", "4096"),
        std::string(R"({"rpi.noise": {"reference_constant": 0, "reference_slope": 2.5}})"),
        std::string(max_tuning_bytes + 1, ' ')}) {
    EXPECT_FALSE(parse_raspberry_tuning(json)) << json.substr(0, 200);
  }
}

// 16-bit codes have the standard deviation slope sqrt(value): the variance of a sensor of n bits is K times its value
// for K = slope^2 / 2^(16 - n).
TEST(RaspberryTuning, HasTheGainOfItsSlope) {
  const RaspberryTuning vc4{.reference_slope = 2.5, .black_level = 4096, .target = "bcm2835"};
  const double value_16 = 1000, variance_16 = std::pow(2.5 * std::sqrt(value_16), 2);
  EXPECT_DOUBLE_EQ(tuning_gain_dn_per_e(vc4, 16), variance_16 / value_16);
  EXPECT_DOUBLE_EQ(tuning_gain_dn_per_e(vc4, 10), (variance_16 / std::pow(64, 2)) / (value_16 / 64));
  RaspberryTuning pisp = vc4;
  pisp.target = "pisp";
  EXPECT_DOUBLE_EQ(tuning_gain_dn_per_e(pisp, 10), tuning_gain_dn_per_e(vc4, 10) / std::sqrt(2.0));
  EXPECT_GT(tuning_gain_factor(pisp), tuning_gain_factor(vc4));
}

TEST(RaspberryTuning, MakesAProfileThatCanBeWrittenAndRead) {
  const RaspberryTuning tuning{.reference_slope = 2.767, .black_level = 4096, .target = "bcm2835"};
  auto sensor = tuned_sensor("imx477_noir.json");
  ASSERT_TRUE(sensor);
  EXPECT_EQ(sensor->bits, 12);
  sensor->source = "imx477.json";
  const auto profile = profile_of_tuning(tuning, *sensor);
  ASSERT_TRUE(profile) << profile.error().message;
  ASSERT_EQ(profile->gains.size(), 2U);
  const SensorModel& model = *profile->gains[0].sensor;
  EXPECT_EQ(model.black_level_dn, 256);
  EXPECT_NEAR(model.system_gain_dn_per_e, 2.767 * 2.767 / 16, 1e-12);
  EXPECT_NEAR(profile->gains[1].sensor->system_gain_dn_per_e, 16 * model.system_gain_dn_per_e, 1e-12);
  EXPECT_GT(profile->gains[0].errors.system_gain_dn_per_e, 0);
  const auto text = profile_text(*profile);
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_TRUE(parse_profile(*text));
  EXPECT_FALSE(profile_of_tuning(tuning, {.name = "x", .bits = 7}));
  EXPECT_FALSE(profile_of_tuning(tuning, {.name = "x", .bits = 12, .max_gain = 1}));
  EXPECT_FALSE(tuned_sensor("unknown.json"));
}

TEST(RaspberrySensors, HaveAProfileByName) {
  const auto profile = raspberry_profile("imx219");
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->gains[0].sensor->bits, 10);
  EXPECT_NEAR(profile->gains[0].sensor->system_gain_dn_per_e, 3.67 * 3.67 / 64, 1e-12);
  EXPECT_NE(profile->gains[0].provenance.front().source.find("BSD-2-Clause"), std::string::npos);
  EXPECT_FALSE(raspberry_profile("imx"));
}

// Published figures of the HQ camera's imx477 (calib/profiles/RaspberryPi_HQ.json): 0.47 DN/e- at gain 1, 12 bits,
// black 256.3. The stated uncertainty has to cover them.
TEST(RaspberrySensors, AgreeWithAMeasurementOfTheHqCamera) {
  const auto found = find_raspberry_noise("Raspberry Pi", "/base/soc/i2c0mux/i2c@1/imx477@1a", 100, 4095 - 256.3);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sensor, "imx477");
  EXPECT_LT(std::abs(std::log(found->figures.gain_dn_per_e / 0.47)), std::log(found->figures.gain_factor));
  EXPECT_LT(std::abs(std::log(found->figures.read_noise_e / 3.0)), std::log(found->figures.read_noise_factor));
}

TEST(RaspberrySensors, AreThoseOfRaspberryPiAtAGain) {
  const auto at = [](const char* make, const char* model, double iso) {
    return find_raspberry_noise(make, model, iso, 1000);
  };
  ASSERT_TRUE(at("RaspberryPi", "RP_IMX219", 100) && at("Raspberry Pi", "imx219", 400));
  EXPECT_NEAR(at("Raspberry Pi", "imx219", 400)->figures.gain_dn_per_e,
              4 * at("Raspberry Pi", "imx219", 100)->figures.gain_dn_per_e, 1e-9);
  EXPECT_FALSE(at("Sony", "imx219", 100));
  EXPECT_FALSE(at("Raspberry Pi", "imx999", 100));
  EXPECT_FALSE(at("Raspberry Pi", "imx219", 1e6));
  EXPECT_FALSE(at("Raspberry Pi", "imx219", NAN));
}

}  // namespace
}  // namespace lowlux::calib
