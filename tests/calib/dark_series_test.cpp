#include "calib/dark/dark_series.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "capture/synthetic/fixed_pattern.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

using test::SensorBench;

DarkGroup group_at(const SensorBench& bench, const isp::Exposure& exposure, int frames, std::uint32_t first) {
  DarkStack stack;
  for (int i = 0; i < frames; ++i) {
    const auto added = stack.add(bench.frame(exposure, first + static_cast<std::uint32_t>(i)));
    EXPECT_TRUE(added) << added.error().message;
  }
  return std::move(*stack.group());
}

std::vector<DarkGroup> groups_at(const SensorBench& bench, const std::vector<isp::Exposure>& exposures, int frames) {
  std::vector<DarkGroup> out;
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    out.push_back(group_at(bench, exposures[i], frames, static_cast<std::uint32_t>(1000 * i)));
  }
  return out;
}

Estimate exact_gain(const SensorBench& bench) { return {bench.sensor.system_gain_dn_per_e, 0}; }

double largest(const std::array<double, 3>& v) { return *std::max_element(v.begin(), v.end()); }

class DarkSeriesOf : public testing::TestWithParam<SensorModel> {};

TEST_P(DarkSeriesOf, FindsPedestalAndDarkCurrent) {
  SensorBench bench{.sensor = GetParam(), .width = 448, .height = 448};
  const SensorModel& truth = bench.sensor;
  const double time_s = 40 / largest(truth.dark_current_e_per_s);  // 40 e-
  const auto groups = groups_at(bench, {{0, 20}, {time_s / 3, 20}, {time_s, 20}}, 6);
  const auto found = fit_dark_series(groups, exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  double sum = 0;
  for (const double d : truth.dark_current_e_per_s) sum += d;
  ASSERT_EQ(found->currents.size(), 1U);
  EXPECT_EQ(found->currents[0].temperature_c, 20);
  ASSERT_TRUE(found->chromaticity);
  for (int k = 0; k < 3; ++k) {
    const Estimate& current = found->currents[0].current_e_per_s[k];
    EXPECT_NEAR(current.value, truth.dark_current_e_per_s[k], 3 * current.standard_error) << "RGB"[k];
    const Estimate& share = (*found->chromaticity)[k];
    EXPECT_NEAR(share.value, truth.dark_current_e_per_s[k] / sum, 5 * share.standard_error);
  }
  for (const Estimate& pedestal : found->pedestal_dn) {
    EXPECT_NEAR(pedestal.value, truth.black_level_dn, 3.5 * pedestal.standard_error);
    // 50,000 pixels of 6 frames: read noise, quantisation, and the columns, which do not average over rows.
    const double gain = truth.system_gain_dn_per_e;
    const double white2 = (std::pow(gain * truth.read_noise_e, 2) + 1.0 / 12) / (6 * 50176);
    const double rows2 = std::pow(gain * truth.row_noise_e, 2) / (6 * 224);
    const double columns2 = std::pow(gain * truth.column_noise_e, 2) / 224;
    EXPECT_LT(pedestal.standard_error, 1.5 * std::sqrt(white2 + rows2 + columns2));
  }
  EXPECT_FALSE(found->law);
  // 224 columns at each of four sites, two of which share them, so 448 at least: 5 sqrt(2 / 448) of the variance.
  EXPECT_NEAR(std::pow(found->column_noise_e, 2), std::pow(truth.column_noise_e, 2),
              5 * std::sqrt(2.0 / 448) * (std::pow(truth.column_noise_e, 2) + std::pow(truth.read_noise_e, 2) / 224));
  EXPECT_NEAR(std::pow(found->row_noise_e, 2), std::pow(truth.row_noise_e, 2),
              5 * std::sqrt(2.0 / (448 * 15)) *
                  (std::pow(truth.row_noise_e, 2) + (std::pow(truth.read_noise_e, 2) + 40) / 224));
  if (truth.dsnu > 0) {
    EXPECT_NEAR(found->dsnu.value, truth.dsnu, 0.02 * truth.dsnu);  // 200,000 pixels, half of the variance is temporal
  }
}

INSTANTIATE_TEST_SUITE_P(Sensors, DarkSeriesOf,
                         testing::Values(test::modern_small(), test::modern_large(), test::column_noise_sensor(),
                                         test::hot_sensor(), test::range_limited()),
                         [](const auto& named) {
                           std::string name = named.param.name;
                           std::erase(name, ' ');
                           return name;
                         });

// One exposure at a second temperature determines its current: the fit passes through it, and no quotient of rounding
// errors is left. The others are judged as usual.
TEST(DarkSeries, HasNoResidualWhereOneSettingDeterminesAParameter) {
  const SensorBench bench{.sensor = test::hot_sensor(), .width = 256, .height = 256};
  const auto found = fit_dark_series(groups_at(bench, {{0, 20}, {1, 20}, {2, 20}, {2, 28}}, 4), exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->degrees_of_freedom, 4);
  int exact = 0;
  for (const DarkPoint& point : found->points) {
    const Estimate& off = point.residual_dn;
    if (point.group == 3) {
      EXPECT_EQ(off, Estimate{});
      ++exact;
    } else {
      EXPECT_LT(std::fabs(off.value), 6 * off.standard_error);
      EXPECT_GT(off.standard_error, 1e-6);
    }
  }
  EXPECT_EQ(exact, 4);
}

TEST(DarkSeries, FindsTheTemperatureLaw) {
  SensorBench bench{.sensor = test::hot_sensor(), .width = 192, .height = 192};
  bench.sensor.dark_doubling_c = 6.3;
  const auto groups = groups_at(bench, {{0, 20}, {5, 10}, {5, 20}, {5, 30}, {2, 30}}, 4);
  const auto found = fit_dark_series(groups, exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->currents.size(), 3U);
  ASSERT_TRUE(found->law);
  EXPECT_EQ(found->law->temperature_c, 30);
  EXPECT_EQ(found->law->degrees_of_freedom, 5);
  EXPECT_LT(found->law->reduced_chi_square, 1 + 5 * std::sqrt(2.0 / 5));
  EXPECT_EQ(found->law->misfit, 0);
  EXPECT_NEAR(found->law->doubling_c.value, 6.3, 5 * found->law->doubling_c.standard_error);
  EXPECT_LT(found->law->doubling_c.standard_error, 0.05);
  for (int k = 0; k < 3; ++k) {
    const Estimate& current = found->law->current_e_per_s[k];
    EXPECT_NEAR(current.value, bench.sensor.dark_current_e_per_s[k] * std::exp2(10 / 6.3), 5 * current.standard_error);
  }
}

// Silicon follows Arrhenius' law, often with a floor: a profile of darks from 5 to 50 C, which states a doubling, is
// off by many of the errors that the noise of the darks alone gives.
TEST(DarkSeries, ErrorsOfTheLawIncludeThatTheCurrentDoesNotDouble) {
  constexpr unsigned seed = 20261130;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> energy(0.5, 0.9), part(0, 0.3);
  for (int round = 0; round < 8; ++round) {
    SensorBench bench{.sensor = test::modern_large(), .width = 128, .height = 128, .seed = random()};
    bench.sensor.dark_temperature_c = 20;
    bench.sensor.dark_current_e_per_s = {4, 4, 4};
    bench.sensor.dark_activation_ev = energy(random);
    bench.sensor.dark_floor_e_per_s = 4 * part(random);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", round " << round << ", " << bench.sensor.dark_activation_ev
                                    << " eV");
    const auto groups = groups_at(bench, {{0, 20}, {8, 5}, {8, 20}, {8, 35}, {8, 50}}, 4);
    const auto found = fit_dark_series(groups, exact_gain(bench));
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_TRUE(found->law);
    EXPECT_GT(found->law->misfit, 0.01);
    for (int k = 0; k < 3; ++k) {
      const Estimate& current = found->law->current_e_per_s[k];
      EXPECT_NEAR(current.value, isp::dark_mean_e(bench.sensor, {1, 50})[k], 3 * current.standard_error);
    }
  }
}

TEST(DarkSeries, IntervalsHoldTheTruthAndMeansHaveNoBias) {
  SensorBench bench{.sensor = test::column_noise_sensor(), .width = 96, .height = 96};
  bench.sensor.hot_pixel_fraction = 0.002;
  bench.sensor.hot_pixel_current_e_per_s = 300;
  constexpr int seeds = 200;
  struct Tally {
    int held = 0;
    double off = 0, error = 0;
    void add(const Estimate& e, double truth) {
      held += std::fabs(e.value - truth) <= 1.96 * e.standard_error;
      off += e.value - truth;
      error += e.standard_error;
    }
  } pedestal, current;
  for (int seed = 1; seed <= seeds; ++seed) {
    bench.seed = static_cast<std::uint64_t>(seed);
    const auto found = fit_dark_series(groups_at(bench, {{0, 20}, {2, 20}}, 4), exact_gain(bench));
    ASSERT_TRUE(found) << found.error().message;
    pedestal.add(found->pedestal_dn[0], bench.sensor.black_level_dn);
    current.add(found->currents[0].current_e_per_s[1], bench.sensor.dark_current_e_per_s[1]);
  }
  for (const Tally& t : {pedestal, current}) {
    EXPECT_GE(t.held, 0.9 * seeds);
    EXPECT_LE(t.held, 0.995 * seeds);
    // A bias of a fifth of 3.5 errors would still do; five errors of the mean over the seeds are half of that.
    EXPECT_LT(std::fabs(t.off), 5 * t.error / std::sqrt(seeds));
  }
  RecordProperty("pedestal_held", pedestal.held);
  RecordProperty("current_held", current.held);
}

TEST(DarkSeries, MeansAreNotMovedByLeavingOutThePoissonTail) {
  // Counts of two and more lie beyond five deviations: without the correction a tenth of the current would be missing.
  SensorBench bench{.sensor = test::modern_small(), .width = 512, .height = 512};
  bench.sensor.system_gain_dn_per_e = 8;
  bench.sensor.read_noise_e = 0.15;
  bench.sensor.dark_current_e_per_s = {0.05, 0.05, 0.05};
  const auto found = fit_dark_series(groups_at(bench, {{0, 20}, {1, 20}}, 2), exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  for (const Estimate& current : found->currents[0].current_e_per_s) {
    EXPECT_GT(found->largest_correction_dn / 8, 4 * current.standard_error);
    EXPECT_NEAR(current.value, 0.05, 5 * current.standard_error);
  }
}

TEST(DarkSeries, ListsTheHotPixelsAndNoOthers) {
  SensorBench bench{.sensor = test::hot_sensor(), .width = 512, .height = 512};
  const double time_s = 4;
  const auto groups = groups_at(bench, {{0, 20}, {time_s, 20}}, 16);
  const auto found = fit_dark_series(groups, exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  const SensorModel& s = bench.sensor;
  std::set<std::pair<int, int>> truth, listed;
  for (int y = 0; y < bench.height; ++y) {
    std::vector<float> charge(bench.width, 0);
    std::vector<std::uint32_t> scratch(bench.width);
    capture::add_hot_pixels({bench.seed, 0, static_cast<std::uint32_t>(y)}, s.hot_pixel_fraction,
                            s.hot_pixel_current_e_per_s * time_s, charge, scratch);
    for (int x = 0; x < bench.width; ++x) {
      const double dark = time_s * s.dark_current_e_per_s[static_cast<int>(colour_at(bench.phase, x, y))];
      const double noise2 = dark + std::pow(s.read_noise_e, 2) + std::pow(s.dsnu * dark, 2) + 1 / (12 * 0.64);
      if (charge[x] > 8 * std::sqrt(noise2)) truth.emplace(x, y);
    }
  }
  for (const HotPixel& hot : found->hot) listed.emplace(hot.x, hot.y);
  std::vector<std::pair<int, int>> both;
  std::set_intersection(truth.begin(), truth.end(), listed.begin(), listed.end(), std::back_inserter(both));
  ASSERT_GT(truth.size(), 400U);
  EXPECT_GT(static_cast<double>(both.size()), 0.98 * static_cast<double>(truth.size()));   // recall
  EXPECT_GT(static_cast<double>(both.size()), 0.98 * static_cast<double>(listed.size()));  // precision
  EXPECT_EQ(found->hot_temperature_c, 20);
}

TEST(DarkSeries, SixteenDarksFindDefectsAboveEightDeviationsOfOneFramesTemporalNoise) {
  SensorBench bench{.sensor = test::modern_small(), .width = 512, .height = 512};
  bench.sensor.hot_pixel_fraction = 0.002;
  bench.sensor.hot_pixel_current_e_per_s = 100;
  const SensorModel& s = bench.sensor;
  const auto found = fit_dark_series(groups_at(bench, {{0, 20}, {10, 20}}, 16), exact_gain(bench));
  ASSERT_TRUE(found) << found.error().message;
  double truth = 0, both = 0;
  for (int y = 0; y < bench.height; ++y) {
    std::vector<float> charge(bench.width, 0);
    std::vector<std::uint32_t> scratch(bench.width);
    capture::add_hot_pixels({bench.seed, 0, static_cast<std::uint32_t>(y)}, s.hot_pixel_fraction,
                            s.hot_pixel_current_e_per_s * 10, charge, scratch);
    for (int x = 0; x < bench.width; ++x) {
      const double dark_e = 10 * s.dark_current_e_per_s[static_cast<int>(colour_at(bench.phase, x, y))];
      if (charge[x] <= 8 * std::sqrt(dark_e + std::pow(s.read_noise_e, 2) + 1 / (12 * 0.47 * 0.47))) continue;
      ++truth;
      both += std::ranges::any_of(found->hot, [&](const HotPixel& hot) { return hot.x == x && hot.y == y; });
    }
  }
  ASSERT_GT(truth, 400);
  // Only what lies within 1.25 deviations (4 e-) of the threshold, five standard errors of a mean of 16, may fall on
  // either side: of charges of 1000 e- in the mean that is less than a hundredth.
  EXPECT_GT(both, 0.98 * truth);
  EXPECT_GT(both, 0.98 * static_cast<double>(found->hot.size()));
}

std::string refusal(std::vector<DarkGroup> groups, const Estimate& gain = {0.47, 0.001}) {
  const auto found = fit_dark_series(groups, gain);
  return found ? "" : found.error().message;
}

SensorBench small_bench() { return {.sensor = test::modern_small(), .width = 64, .height = 64}; }

TEST(DarkSeries, SeesLightThatLeaksInOnOneSide) {
  SensorBench bench = small_bench();
  const std::vector<isp::Exposure> exposures{{0, 20}, {20, 20}};
  EXPECT_EQ(refusal(groups_at(bench, exposures, 4)), "");
  bench.rate_e_per_s = {2, 2, 2};
  bench.shading = 1;
  EXPECT_NE(refusal(groups_at(bench, exposures, 4)).find("light reaches the sensor"), std::string::npos);
}

TEST(DarkSeries, SeesDarksThatAreNotLinearInTime) {
  SensorBench bench = small_bench();
  const auto with_light = [&](double rate_e_per_s) {
    auto groups = groups_at(bench, {{0, 20}, {10, 20}}, 4);
    SensorBench lit = bench;
    lit.rate_e_per_s = {rate_e_per_s, rate_e_per_s, rate_e_per_s};
    groups.push_back(group_at(lit, {20, 20}, 4, 9000));
    return refusal(std::move(groups));
  };
  EXPECT_EQ(with_light(0), "");
  EXPECT_NE(with_light(1).find("not linear"), std::string::npos);
}

TEST(DarkSeries, RefusesSingleFramesAndFramesWithoutTime) {
  const SensorBench bench{.sensor = test::modern_small(), .width = 64, .height = 64};
  auto groups = groups_at(bench, {{0, 20}, {60, 20}}, 2);
  groups[0].frames = 1;
  EXPECT_NE(fit_dark_series(groups, exact_gain(bench)).error().message.find("one dark frame at 0 s"),
            std::string::npos);
  groups[0].frames = 2;
  groups[1].setting.exposure_s.reset();
  EXPECT_NE(fit_dark_series(groups, exact_gain(bench)).error().message.find("no exposure time"), std::string::npos);
}

TEST(DarkSeries, RefusesTooFewExposures) {
  const SensorBench bench = small_bench();
  EXPECT_NE(refusal({}).find("no dark frames"), std::string::npos);
  EXPECT_NE(refusal(groups_at(bench, {{1, 20}}, 2)).find("exposure time"), std::string::npos);
  EXPECT_NE(refusal(groups_at(bench, {{1, 20}, {1, 20}}, 2)).find("exposure time"), std::string::npos);
  EXPECT_NE(refusal(groups_at(bench, {{1, 20}, {1, 30}}, 2)).find("exposure time"), std::string::npos);
}

TEST(DarkSeries, RefusesCodesThatGiveNoMeans) {
  SensorBench bench{.sensor = test::thesis_like(), .width = 64, .height = 64};
  EXPECT_NE(refusal(groups_at(bench, {{0, 20}, {1, 20}}, 4)).find("average out the rounding"), std::string::npos);
  bench.sensor = test::modern_small();
  bench.sensor.black_level_dn = 0;
  EXPECT_NE(refusal(groups_at(bench, {{0, 20}, {1, 20}}, 4)).find("code 0"), std::string::npos);
}

TEST(DarkSeries, RefusesSaturatedDarks) {
  SensorBench bench = small_bench();
  const double current = largest(bench.sensor.dark_current_e_per_s);
  bench.sensor.full_well_e = isp::saturation_charge_e(bench.sensor);
  const double full_s = bench.sensor.full_well_e / current;
  // Saturated in all of several times: the mean is linear in none of them, but two of them are equal.
  EXPECT_NE(refusal(groups_at(bench, {{1.5 * full_s, 20}, {3 * full_s, 20}}, 4)).find("are saturated"),
            std::string::npos);
  EXPECT_NE(refusal(groups_at(bench, {{0, 20}, {1.1 * full_s, 20}}, 4)).find("are saturated"), std::string::npos);
  EXPECT_EQ(refusal(groups_at(bench, {{0, 20}, {0.7 * full_s, 20}}, 4)), "");
}

TEST(DarkSeries, RefusesAFrameFullOfOutliers) {
  SensorBench bench = small_bench();
  bench.sensor.hot_pixel_fraction = 0.1;
  bench.sensor.hot_pixel_current_e_per_s = 500;
  EXPECT_NE(refusal(groups_at(bench, {{0, 20}, {1, 20}}, 4)).find("% of the pixels are outliers"), std::string::npos);
}

TEST(DarkSeries, RefusesGroupsOfDifferentCamerasAndGainsThatAreNone) {
  const SensorBench bench = small_bench();
  const auto with = [&](auto change) {
    auto groups = groups_at(bench, {{0, 20}, {1, 20}}, 2);
    change(groups[1].setting);
    return refusal(std::move(groups));
  };
  EXPECT_NE(with([](FrameSetting& s) { s.model = "other"; }).find("camera"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.iso = 100; }).find("ISO"), std::string::npos);
  EXPECT_NE(with([](FrameSetting& s) { s.temperature_c.reset(); }).find("temperature"), std::string::npos);
  for (const Estimate& gain : {Estimate{0, 0}, Estimate{-1, 0}, Estimate{std::nan(""), 0}, Estimate{1, std::nan("")}}) {
    EXPECT_NE(refusal(groups_at(bench, {{0, 20}, {1, 20}}, 2), gain).find("gain"), std::string::npos);
  }
}

}  // namespace
}  // namespace lowlux::calib
