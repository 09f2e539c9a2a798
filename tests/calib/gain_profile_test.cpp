#include "calib/profile/gain_profile.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calib/profile/profile_use.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib::gain_profile_test {
namespace {

using test::SensorBench;

const Measured today{"a program", "2026-01-02", {"a.dng"}};

std::vector<DarkGroup> darks(const SensorBench& bench, const std::vector<isp::Exposure>& exposures) {
  std::vector<DarkGroup> out;
  std::uint32_t index = 0;
  for (const isp::Exposure& exposure : exposures) {
    DarkStack stack;
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(stack.add(bench.frame(exposure, index++)));
    out.push_back(std::move(*stack.group()));
  }
  return out;
}

/// A profile of darks at 0 and 10 s, counted with a system gain that need not be the sensor's.
GainProfile of_darks(const SensorBench& bench, const Estimate& gain) {
  const auto groups = darks(bench, {{0, 20}, {10, 20}});
  const auto series = fit_dark_series(groups, gain);
  EXPECT_TRUE(series);
  GainProfile out;
  put_dark_series(*series, groups, gain, today, out);
  return out;
}

PhotonTransfer transfer_of(const SensorModel& sensor) {
  PhotonTransfer out;
  out.system_gain_dn_per_e = {sensor.system_gain_dn_per_e, 0.001};
  out.read_noise_e = Estimate{sensor.read_noise_e, 0.01};
  out.black_dn = {7, 7, 7, 7};
  return out;
}

double black_at_10_s(const GainProfile& gain, const SensorBench& bench) {
  RawDn raw = bench.frame({10, 20}, 99);
  CameraProfile profile;
  profile.gains.push_back(gain);
  const auto found = profile_at(profile, raw);
  EXPECT_TRUE(found && found->black);
  return found->black->pedestal_dn[0];
}

TEST(GainProfile, BlackIsTheSameWhateverGainElectronsAreCountedWith) {
  const SensorBench bench{.sensor = test::column_noise_sensor(), .width = 128, .height = 128};
  const double k = bench.sensor.system_gain_dn_per_e;
  GainProfile wrong = of_darks(bench, {0.75 * k, 0});
  const GainProfile right = of_darks(bench, {k, 0});
  const double expected = black_at_10_s(right, bench);
  EXPECT_NEAR(black_at_10_s(wrong, bench), expected, 1e-4);  // DN: what leaving out pixels does depends on the gain
  put_photon_transfer(transfer_of(bench.sensor), darks(bench, {{0, 20}})[0].setting, today, wrong);
  EXPECT_NEAR(black_at_10_s(wrong, bench), expected, 1e-4);  // the flats' gain counts anew, their black does not
  EXPECT_NEAR(wrong.sensor->dark_current_e_per_s[1], right.sensor->dark_current_e_per_s[1], 1e-5);
  EXPECT_NEAR(wrong.sensor->full_well_e, right.sensor->full_well_e, 1e-6);
  EXPECT_EQ(wrong.dark_exposure_s, right.dark_exposure_s);
}

TEST(GainProfile, TheGainsErrorIsNoneOfTheBlackPoints) {
  const SensorBench bench{.sensor = test::column_noise_sensor(), .width = 128, .height = 128};
  const double k = bench.sensor.system_gain_dn_per_e;
  const RawDn raw = bench.frame({10, 20}, 99);
  const auto error = [&](double gain_error) {
    CameraProfile profile;
    profile.gains.push_back(of_darks(bench, {k, gain_error}));
    return profile_at(profile, raw)->black->pedestal_standard_error_dn[0];
  };
  EXPECT_NEAR(error(0.02 * k), error(0), 1e-6);
}

TEST(GainProfile, FlatsAloneHoldTheBlackOfTheirDarks) {
  const SensorBench bench{.sensor = test::column_noise_sensor(), .width = 64, .height = 64};
  GainProfile gain;
  put_photon_transfer(transfer_of(bench.sensor), darks(bench, {{0.5, 20}})[0].setting, today, gain);
  EXPECT_EQ(gain.pedestal_holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_EQ(gain.dark_exposure_s, (MeasuredRange{0.5, 0.5}));
  CameraProfile profile;
  profile.gains.push_back(gain);
  EXPECT_EQ(profile_at(profile, bench.frame({10, 20}, 0))->warnings.size(), 1U);
}

TEST(GainProfile, AReadNoiseThatIsUnknownIsABoundAndSaysSo) {
  const SensorBench bench{.sensor = test::thesis_like(), .width = 64, .height = 64};
  PhotonTransfer transfer = transfer_of(bench.sensor);
  transfer.read_noise_e.reset();
  GainProfile gain;
  put_photon_transfer(transfer, darks(bench, {{0, 20}})[0].setting, today, gain);
  EXPECT_NEAR(gain.sensor->read_noise_e, 0.5 / bench.sensor.system_gain_dn_per_e, 1e-9);
  const bool said = std::any_of(gain.provenance.begin(), gain.provenance.end(), [](const Provenance& p) {
    return p.figures == "read noise" && p.kind == Provenance::Kind::quoted;
  });
  EXPECT_TRUE(said);
}

TEST(GainProfile, OnePictureLeavesAMeasuredPedestalAlone) {
  const SensorBench bench{.sensor = test::column_noise_sensor(), .width = 64, .height = 64};
  GainProfile gain = of_darks(bench, {bench.sensor.system_gain_dn_per_e, 0});
  const auto pedestal = gain.pedestal_dn;
  PictureNoise noise;
  noise.gain_dn_per_e = {bench.sensor.system_gain_dn_per_e, 0.01};
  noise.offset_dn2 = {9, 0.1};
  const BlackPoint tag{.pedestal_dn = {1, 1, 1, 1}};
  put_picture_noise(noise, tag, darks(bench, {{3, 20}})[0].setting, today, gain);
  EXPECT_EQ(gain.pedestal_dn, pedestal);
  EXPECT_EQ(gain.dark_exposure_s, (MeasuredRange{0, 10}));
  GainProfile alone;
  put_picture_noise(noise, tag, darks(bench, {{3, 20}})[0].setting, today, alone);
  EXPECT_EQ((*alone.pedestal_dn)[2].value, 1);
  EXPECT_FALSE(alone.dark_exposure_s);  // a tag is no dark frame
}

TEST(GainProfile, HotPixelsAreCountedWhereTheyAreNotFullAndAtTheModelsTemperature) {
  SensorBench bench{.sensor = test::column_noise_sensor(), .width = 64, .height = 64};
  bench.sensor.dark_doubling_c = 6;
  auto groups = darks(bench, {{0, 10}, {2, 10}, {8, 10}, {0, 22}, {1, 22}});
  const double k = bench.sensor.system_gain_dn_per_e;
  // 1500 e-/s at 10 C are full within 8 s, not within 2 s.
  groups[1].mean_dn.at(20, 20) = static_cast<float>(300 + 3000 * k);
  groups[2].mean_dn.at(20, 20) = 4095;
  groups[4].mean_dn.at(20, 20) = 4095;
  const auto series = fit_dark_series(groups, {k, 0});
  ASSERT_TRUE(series) << series.error().message;
  ASSERT_EQ(series->hot_temperature_c, 10);  // most charge
  ASSERT_TRUE(series->law);
  EXPECT_EQ(series->law->temperature_c, 22);  // most current
  ASSERT_EQ(series->hot.size(), 1U);
  EXPECT_NEAR(series->hot[0].excess_e_per_s, 1500, 10);
  GainProfile gain;
  put_dark_series(*series, groups, {k, 0}, today, gain);
  EXPECT_NEAR(gain.hot_pixels[0].excess_e_per_s, 1500 * std::exp2(12 / series->law->doubling_c.value), 100);
}

}  // namespace
}  // namespace lowlux::calib::gain_profile_test
