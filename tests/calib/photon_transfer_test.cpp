#include "calib/flat/photon_transfer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib::photon_transfer_test {
namespace {

using test::SensorBench;

struct Shots {
  std::vector<PairStatistics> darks, flats;
};

PairStatistics pair_at(const SensorBench& bench, const isp::Exposure& exposure, std::uint32_t first) {
  return *measure_pair(bench.frame(exposure, first), bench.frame(exposure, first + 1));
}

// Levels as shares of what fills green; red and blue get 0.75 and 0.9 of it.
constexpr double levels[] = {0.01, 0.03, 0.08, 0.15, 0.25, 0.35, 0.45, 0.52, 0.57, 0.62, 0.66, 0.8, 0.9, 1.5, 2.5};

double saturation_e(const SensorModel& s) { return isp::saturation_charge_e(s); }

Shots shoot(SensorBench bench, int pairs = 2) {
  Shots out;
  std::uint32_t frame = 0;
  const double fill = saturation_e(bench.sensor);
  for (int i = 0; i < 4 * pairs; ++i, frame += 2) out.darks.push_back(pair_at(bench, {0, 20}, frame));
  bench.rate_e_per_s = {0.75 * fill, fill, 0.9 * fill};
  for (const double level : levels) {
    for (int i = 0; i < pairs; ++i, frame += 2) out.flats.push_back(pair_at(bench, {level, 20}, frame));
  }
  return out;
}

/// Standard error of the square of a figure that is the root of it: near 0 the square is what is normal.
double error_of_square(const Estimate& e) {
  return std::max(2 * e.value * e.standard_error, 4 * e.standard_error * e.standard_error);
}

void expect_square(const Estimate& found, double truth, double truth_error_of_square = 0) {
  EXPECT_NEAR(found.value * found.value, truth * truth, 5 * (error_of_square(found) + truth_error_of_square));
}

// What a calibration has to reach; and five of the fit's own errors.
void expect_estimate(const Estimate& found, double truth, double relative) {
  EXPECT_NEAR(found.value, truth, relative * truth);
  EXPECT_NEAR(found.value, truth, 5 * found.standard_error);
}

class PhotonTransferOf : public testing::TestWithParam<SensorModel> {};

TEST_P(PhotonTransferOf, FindsTheSensorsFigures) {
  const SensorModel& truth = GetParam();
  const Shots shots = shoot({.sensor = truth, .width = 512, .height = 512}, 2);
  const auto found = fit_photon_transfer(shots.darks, shots.flats, {.steady_light = true});
  ASSERT_TRUE(found) << found.error().message;
  const double noise = std::hypot(truth.read_noise_e, truth.row_noise_e), full = saturation_e(truth);
  expect_estimate(found->system_gain_dn_per_e, truth.system_gain_dn_per_e, 0.005);
  EXPECT_EQ(found->under_dithered, truth.system_gain_dn_per_e * noise < 0.5);
  EXPECT_EQ(found->read_noise_e.has_value(), !found->under_dithered);
  EXPECT_EQ(found->dsnu_e.has_value(), !found->under_dithered);
  if (found->read_noise_e) {
    expect_estimate(*found->read_noise_e, noise, 0.02);
    // At no exposure all that stays are the columns: 512 normal deviates, whose square has an error of sqrt(2 / 512).
    expect_square(*found->dsnu_e, truth.column_noise_e, std::pow(truth.column_noise_e, 2) * std::sqrt(2.0 / 512));
  }
  ASSERT_TRUE(found->saturation && found->saturation_capacity_e);
  EXPECT_NEAR(found->saturation->charge_e.value, full, 0.01 * full);
  const double range_e = (truth.white_level_dn - truth.black_level_dn) / truth.system_gain_dn_per_e;
  EXPECT_EQ(found->saturation->limited_by == Saturation::LimitedBy::converter, range_e < truth.full_well_e);
  EXPECT_NEAR(found->saturation_capacity_e->value, 0.9 * full, 0.15 * full);  // a step of the levels on each side
  EXPECT_LT(found->reduced_chi_square, 1 + 5 * std::sqrt(2.0 / found->degrees_of_freedom));
  EXPECT_LT(found->reduced_chi_square_of_sites, 1 + 5 * std::sqrt(2.0 / 3));
  // The pattern itself is a sample of 262,144 pixels.
  expect_square(found->prnu, truth.prnu, truth.prnu * truth.prnu * std::sqrt(2.0 / (512 * 512)));
  ASSERT_TRUE(found->linearity_error);
  EXPECT_LT(*found->linearity_error, 0.002);  // means of 65,536 pixels scatter by less
}

INSTANTIATE_TEST_SUITE_P(Sensors, PhotonTransferOf,
                         testing::Values(test::thesis_like(), test::modern_small(), test::modern_large(),
                                         test::column_noise_sensor(), test::hot_sensor(), test::range_limited()),
                         [](const auto& named) {
                           std::string name = named.param.name;
                           std::erase_if(name, [](char c) { return c == ' ' || c == '-'; });
                           return name;
                         });

Shots small_shots(const SensorModel& sensor = test::modern_small(), std::uint64_t seed = 1) {
  return shoot({.sensor = sensor, .width = 64, .height = 64, .seed = seed}, 1);
}

// Binomial: 200 intervals of 95 % hold the truth in 90 to 99.5 % of cases unless the errors are wrong by 20 % or so.
TEST(PhotonTransfer, IntervalsContainTheTruthAsOftenAsStated) {
  SensorModel truth = test::column_noise_sensor();
  truth.prnu = 0.02;
  const double noise = std::hypot(truth.read_noise_e, truth.row_noise_e);
  int gain_held = 0, noise_held = 0, black_held = 0, prnu_held = 0;
  double gain_sum = 0, error_sum = 0;
  constexpr int seeds = 200;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Shots shots = small_shots(truth, seed);
    const auto found = fit_photon_transfer(shots.darks, shots.flats);
    ASSERT_TRUE(found) << found.error().message;
    const auto holds = [](const Estimate& e, double value) {
      return std::fabs(e.value - value) <= 1.96 * e.standard_error;
    };
    gain_held += holds(found->system_gain_dn_per_e, truth.system_gain_dn_per_e);
    noise_held += holds(*found->read_noise_e, noise);
    black_held += holds({found->black_dn[0], found->black_standard_error_dn[0]}, truth.black_level_dn);
    prnu_held += holds(found->prnu, truth.prnu);
    gain_sum += found->system_gain_dn_per_e.value;
    error_sum += found->system_gain_dn_per_e.standard_error;
  }
  for (const int held : {gain_held, noise_held, black_held, prnu_held}) {
    EXPECT_GE(held, 0.9 * seeds);
    EXPECT_LE(held, 0.995 * seeds);
  }
  EXPECT_NEAR(gain_sum / seeds, truth.system_gain_dn_per_e, 5 * error_sum / seeds / std::sqrt(seeds));
  RecordProperty("gain_held", gain_held);
  RecordProperty("noise_held", noise_held);
}

TEST(PhotonTransfer, IsNotMovedByShadingOfTheLight) {
  SensorBench bench{.sensor = test::modern_small(), .width = 512, .height = 256, .shading = 0.2};
  const Shots shots = shoot(bench, 1);
  const auto found = fit_photon_transfer(shots.darks, shots.flats);
  ASSERT_TRUE(found) << found.error().message;
  const double gain = bench.sensor.system_gain_dn_per_e;
  EXPECT_NEAR(found->system_gain_dn_per_e.value, gain, 5 * found->system_gain_dn_per_e.standard_error);
  // Within a block of 64 pixels the light falls by 2.5 % of itself: evenly spread, so by 2.5 % / sqrt(12) of deviation.
  EXPECT_NEAR(found->prnu.value, std::hypot(0.008, 0.2 * 64 / 512 / std::sqrt(12.0)), 5 * found->prnu.standard_error);
}

// Red does not reach its peak: its brightest flats are just below the well that green fills, and have lost variance.
TEST(PhotonTransfer, IsNotMovedByAColourThatEndsJustBelowSaturation) {
  constexpr int seeds = 60;
  double gain_sum = 0, error_sum = 0;
  SensorBench bench{.sensor = test::modern_small(), .width = 128, .height = 128};
  const double fill = saturation_e(bench.sensor), gain = bench.sensor.system_gain_dn_per_e;
  for (int seed = 1; seed <= seeds; ++seed) {
    bench.seed = static_cast<std::uint64_t>(seed);
    Shots shots;
    std::uint32_t frame = 0;
    for (int i = 0; i < 4; ++i, frame += 2) shots.darks.push_back(pair_at(bench, {0, 20}, frame));
    const double red = 0.96 + 0.04 * seed / seeds;  // of the well, in the brightest flats
    bench.rate_e_per_s = {red / 1.4 * fill, fill, 0.5 * fill};
    for (int i = 0; i < 10; ++i, frame += 2) {
      shots.flats.push_back(pair_at(bench, {0.01 * std::pow(140.0, i / 9.0), 20}, frame));
    }
    const auto found = fit_photon_transfer(shots.darks, shots.flats);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NEAR(found->system_gain_dn_per_e.value, gain, 5 * found->system_gain_dn_per_e.standard_error) << seed;
    gain_sum += found->system_gain_dn_per_e.value;
    error_sum += found->system_gain_dn_per_e.standard_error;
  }
  EXPECT_NEAR(gain_sum / seeds, gain, 5 * error_sum / seeds / std::sqrt(seeds));
}

TEST(PhotonTransfer, NamesNoSaturationWhereNoneWasReached) {
  Shots shots = small_shots();
  shots.flats.resize(7);
  const auto found = fit_photon_transfer(shots.darks, shots.flats);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->saturation_capacity_e);
  EXPECT_FALSE(found->saturation);
  EXPECT_FALSE(found->linearity_error);  // nobody said that the light was steady
}

TEST(PhotonTransfer, CapacityWithoutPlateauNamesNoPlateau) {
  Shots shots = small_shots(test::range_limited());
  shots.flats.pop_back();
  shots.flats.pop_back();  // the plateaus of all channels
  const auto found = fit_photon_transfer(shots.darks, shots.flats);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->saturation);
}

std::string refusal(const Shots& shots) {
  const auto found = fit_photon_transfer(shots.darks, shots.flats);
  return found ? "" : found.error().message;
}

TEST(PhotonTransfer, RefusesTooLittle) {
  Shots shots = small_shots();
  Shots without = shots;
  without.darks.clear();
  EXPECT_NE(refusal(without).find("no darks"), std::string::npos);
  without = shots;
  without.flats.clear();
  EXPECT_NE(refusal(without).find("0 levels"), std::string::npos);
  without = shots;
  without.flats.resize(3);
  EXPECT_NE(refusal(without).find("3 levels"), std::string::npos);
  without.flats = {shots.flats[2], shots.flats[2], shots.flats[2], shots.flats[2]};
  EXPECT_NE(refusal(without).find("1 levels"), std::string::npos);
  shots.flats.resize(4);
  EXPECT_EQ(refusal(shots), "");
  const Shots small = shoot({.sensor = test::modern_small(), .width = 62, .height = 64}, 1);
  EXPECT_NE(refusal(small).find("992 pixels"), std::string::npos);
}

TEST(PhotonTransfer, RefusesSaturatedFlatsOnly) {
  for (const SensorModel& sensor : {test::modern_small(), test::range_limited()}) {
    Shots shots = small_shots(sensor);
    shots.flats.erase(shots.flats.begin(), shots.flats.end() - 2);
    for (int i = 0; i < 4; ++i) shots.flats.push_back(shots.flats.front());
    EXPECT_NE(refusal(shots).find("add darker flats"), std::string::npos) << sensor.name;
  }
}

TEST(PhotonTransfer, RefusesDarksCutOffAtCodeZero) {
  SensorModel sensor = test::modern_small();
  sensor.black_level_dn = 0;
  EXPECT_NE(refusal(small_shots(sensor)).find("code 0"), std::string::npos);
}

TEST(PhotonTransfer, RefusesLightThatDriftsWithinAPair) {
  Shots shots = small_shots();
  SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 64};
  bench.rate_e_per_s = {3000, 4000, 3500};
  const RawDn a = bench.frame({0.5, 20}, 1000);
  for (const double drift : {0.002, 0.03}) {
    RawDn b = SensorBench(bench).frame({0.5 * (1 + drift), 20}, 1001);
    b.info.exposure_s = 0.5;
    shots.flats.push_back(*measure_pair(a, b));
    EXPECT_EQ(refusal(shots).find("drifts") != std::string::npos, drift > 0.01);
  }
}

TEST(PhotonTransfer, RefusesFlatsNoBrighterThanTheDarks) {
  Shots shots = small_shots();
  PairStatistics swapped = shots.darks.front();
  for (SiteStatistics& s : swapped.site) s.mean_dn -= 1;
  shots.flats.push_back(swapped);
  EXPECT_NE(refusal(shots).find("not brighter"), std::string::npos);
}

TEST(PhotonTransfer, RefusesAVarianceThatDoesNotFollowTheMean) {
  Shots shots = small_shots();
  for (PairStatistics& pair : shots.flats) {
    for (SiteStatistics& s : pair.site) s.variance_dn2 = shots.darks.front().site[0].variance_dn2;
  }
  EXPECT_NE(refusal(shots).find("does not rise"), std::string::npos);
}

TEST(PhotonTransfer, RefusesPairsOfDifferentCamerasOrGains) {
  const Shots shots = small_shots();
  const auto with = [&](auto change) {
    Shots changed = shots;
    change(changed.flats[2].setting);
    return refusal(changed);
  };
  EXPECT_NE(with([](FrameSetting& s) { s.model = "other"; }).find("camera"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.iso = 400; }).find("ISO"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.width = 66; }).find("pixels"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.phase = BayerPhase::bggr; }).find("mosaic"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.white_dn[1] = 1; }).find("white"), std::string::npos);
  Shots changed = shots;
  changed.darks[1].setting.exposure_s = 3;
  EXPECT_NE(refusal(changed).find("exposed"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::calib::photon_transfer_test
