#include "calib/dark/dark_temperature.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

using test::SensorBench;

std::vector<DarkGroup> darks(const SensorBench& bench, const std::vector<double>& charges_e, int frames) {
  std::vector<DarkGroup> out;
  std::uint32_t index = 0;
  for (const double charge : charges_e) {
    DarkStack stack;
    for (int i = 0; i < frames; ++i) {
      EXPECT_TRUE(stack.add(bench.frame({charge / bench.sensor.dark_current_e_per_s[1], 20}, index++)));
    }
    out.push_back(std::move(*stack.group()));
  }
  return out;
}

class GainOfDarks : public testing::TestWithParam<SensorModel> {};

TEST_P(GainOfDarks, IsThatOfTheSensor) {
  const SensorBench bench{.sensor = GetParam(), .width = 256, .height = 256};
  const auto groups = darks(bench, {1, 200}, 8);
  const auto gain = gain_of_darks(groups);
  ASSERT_TRUE(gain) << gain.error().message;
  EXPECT_NEAR(gain->value, bench.sensor.system_gain_dn_per_e, 5 * gain->standard_error);
  EXPECT_LT(gain->standard_error, 0.01 * gain->value);
}

INSTANTIATE_TEST_SUITE_P(Sensors, GainOfDarks,
                         testing::Values(test::modern_small(), test::column_noise_sensor(), test::hot_sensor()),
                         [](const auto& sensor) {
                           std::string name = sensor.param.name;
                           std::erase(name, ' ');
                           return name;
                         });

TEST(DarkGain, IntervalsContainTheTruthAsOftenAsStated) {
  SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 64};
  constexpr int seeds = 200;
  int held = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    bench.seed = static_cast<std::uint64_t>(seed);
    const auto groups = darks(bench, {1, 300}, 4);
    const auto gain = gain_of_darks(groups);
    ASSERT_TRUE(gain) << gain.error().message;
    held += std::fabs(gain->value - bench.sensor.system_gain_dn_per_e) <= 1.96 * gain->standard_error;
  }
  EXPECT_GE(held, 0.90 * seeds);
  EXPECT_LE(held, 0.995 * seeds);
}

TEST(DarkGain, IsRefusedWithoutDarkChargeToSpeakOf) {
  const SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 64};
  const auto short_darks = darks(bench, {0.01, 0.02}, 4);
  const auto gain = gain_of_darks(short_darks);
  ASSERT_FALSE(gain);
  EXPECT_NE(gain.error().message.find("--system-gain"), std::string::npos);
  EXPECT_FALSE(gain_of_darks(darks(bench, {100}, 4)));
  EXPECT_FALSE(gain_of_darks({}));
}

}  // namespace
}  // namespace lowlux::calib
