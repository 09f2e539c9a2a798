#include "isp/model/noise_budget.h"

#include <gtest/gtest.h>

namespace lowlux::isp {
namespace {

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

}  // namespace
}  // namespace lowlux::isp
