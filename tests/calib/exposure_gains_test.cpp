#include "calib/noise/exposure_gains.h"

#include <gtest/gtest.h>

#include <vector>

#include "calib/noise/sensor_class.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::calib {
namespace {

const RawFormat format12{12, RawPacking::little16, SensorLayout::bayer, BayerPhase::rggb};

TEST(ExposureGains, AreThoseOfTheClassWhereNoProfileStatesMore) {
  const std::vector<double> factors{1, 2, 8};
  const auto gains = exposure_gains(factors, format12, 4095, nullptr);
  ASSERT_TRUE(gains);
  ASSERT_EQ(gains->size(), 3u);
  const auto& lowest = gains->front().sensor;
  for (const isp::GainStep& gain : *gains) {
    EXPECT_TRUE(isp::check_sensor(gain.sensor)) << gain.factor;
    EXPECT_NEAR(gain.sensor.system_gain_dn_per_e, gain.factor * lowest.system_gain_dn_per_e, 1e-9);
    EXPECT_NEAR(gain.sensor.full_well_e, large_sensor_e, 1e-6);
  }
  EXPECT_LT(gains->back().sensor.read_noise_e, lowest.read_noise_e);
  const CameraProfile without_gains;
  EXPECT_EQ(exposure_gains(factors, format12, 4095, &without_gains)->front().sensor.read_noise_e, lowest.read_noise_e);
}

TEST(ExposureGains, AreThoseOfTheProfileInCodesOfTheStream) {
  CameraProfile profile;
  for (const double iso : {100.0, 400.0}) {
    GainProfile gain;
    gain.iso = iso;
    gain.sensor.emplace();
    gain.sensor->bits = 14;
    gain.sensor->white_level_dn = 16383;
    gain.sensor->full_well_e = 50000;
    gain.sensor->system_gain_dn_per_e = 0.3 * iso / 100;
    gain.sensor->read_noise_e = iso == 100 ? 6 : 3;
    gain.sensor->dark_current_e_per_s = {1, 2, 3};
    profile.gains.push_back(gain);
  }
  const std::vector<double> factors{1, 4};
  const auto gains = exposure_gains(factors, format12, 4095, &profile);
  ASSERT_TRUE(gains) << gains.error().message;
  EXPECT_NEAR((*gains)[0].sensor.system_gain_dn_per_e, 0.3 / 4, 1e-12);
  EXPECT_NEAR((*gains)[1].sensor.system_gain_dn_per_e, 1.2 / 4, 1e-12);
  EXPECT_EQ((*gains)[0].sensor.read_noise_e, 6);
  EXPECT_EQ((*gains)[1].sensor.read_noise_e, 3);
  EXPECT_EQ((*gains)[1].sensor.dark_current_e_per_s[2], 3);
}

}  // namespace
}  // namespace lowlux::calib
