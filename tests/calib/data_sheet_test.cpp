#include "calib/sheet/data_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib::data_sheet_test {
namespace {

using test::SensorBench;

constexpr std::uint64_t first_seed = 20261129;
constexpr int stack_frames = 8;
constexpr double efficiency = 0.6;  // of green
constexpr double dark_times_s[] = {1, 4, 10};
constexpr double dark_temperatures_c[] = {20, 32};
constexpr double levels[] = {0.01, 0.03, 0.08, 0.15, 0.25, 0.35, 0.45, 0.52, 0.57, 0.62,
                             0.66, 0.8,  0.9,  0.95, 1,    1.05, 1.1,  1.2,  1.35, 1.5};

SensorModel drawn_sensor(std::mt19937_64& random) {
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  SensorModel out{.name = "drawn",
                  .system_gain_dn_per_e = draw(0.4, 2),
                  .read_noise_e = draw(1.5, 6),
                  .bits = 16,
                  .black_level_dn = draw(200, 600),
                  .white_level_dn = 65535,
                  .dark_temperature_c = 20,
                  .dark_doubling_c = draw(5, 9),
                  .prnu = draw(0.004, 0.02),
                  .dsnu = draw(0.1, 0.28),  // no pixel at 0
                  .row_noise_e = draw(0, 1),
                  .column_noise_e = draw(0.3, 2)};
  out.full_well_e = draw(8000, 25000);
  out.dark_current_e_per_s.fill(draw(2, 6));
  return out;
}

/// Adds frames to a stack. @param first  index of the first frame: noise of its own
DarkGroup stack_of(const SensorBench& bench, const isp::Exposure& exposure, std::uint32_t first) {
  DarkStack stack;
  for (std::uint32_t i = 0; i < stack_frames; ++i) EXPECT_TRUE(stack.add(bench.frame(exposure, first + i)));
  return *stack.group();
}

PairStatistics pair_at(const SensorBench& bench, const isp::Exposure& exposure, std::uint32_t first) {
  return *measure_pair(bench.frame(exposure, first), bench.frame(exposure, first + 1));
}

Irradiance irradiance_of(double rate_e_per_s) {
  Irradiance one{.w_per_m2 = 1, .wavelength_nm = 550, .pixel_um2 = 9};
  one.w_per_m2 = rate_e_per_s / efficiency / photons_of(one, 1);
  return one;
}

SheetFrames shoot(SensorBench bench) {
  SheetFrames out;
  std::uint32_t frame = 0;
  for (const double temperature_c : dark_temperatures_c) {
    for (const double time_s : dark_times_s) {
      out.darks.push_back(stack_of(bench, {time_s, temperature_c}, frame));
      frame += stack_frames;
    }
  }
  for (int i = 0; i < 4; ++i, frame += 2) out.dark_pairs.push_back(pair_at(bench, {1, 20}, frame));
  const double fill = isp::saturation_charge_e(bench.sensor);
  bench.rate_e_per_s = {0.75 * fill, fill, 0.9 * fill};
  out.irradiance = irradiance_of(fill);
  for (const double level : levels) {
    for (int i = 0; i < 2; ++i, frame += 2) out.flat_pairs.push_back(pair_at(bench, {level, 20}, frame));
  }
  out.bright = stack_of(bench, {0.5, 20}, frame);
  return out;
}

void expect_near(const char* what, const Estimate& found, double truth) {
  EXPECT_GT(found.standard_error, 0) << what;
  EXPECT_NEAR(found.value, truth, 5 * found.standard_error) << what;
}

/// Near 0 the square of a root is what is normal: its standard error follows from that of the root (root_of).
void expect_root(const char* what, const Estimate& found, double truth) {
  const auto& [root, own] = found;
  const double error = root > 1.96 * own ? 2 * root * own - 1.96 * own * own : std::max(root * own, own * own);
  EXPECT_GT(error, 0) << what;
  EXPECT_NEAR(found.value * found.value, truth * truth, 5 * error) << what;
}

TEST(DataSheet, FiguresOfRandomSensorsReturnWithinTheirStandardErrors) {
  std::mt19937_64 random(first_seed);
  for (int round = 0; round < 5; ++round) {
    const SensorModel truth = drawn_sensor(random);
    const SensorBench bench{.sensor = truth, .width = 256, .height = 192, .seed = random()};
    SCOPED_TRACE(testing::Message() << "round " << round << ", seed " << bench.seed);
    const SheetFrames frames = shoot(bench);
    const auto sheet = make_data_sheet(frames);
    ASSERT_TRUE(sheet) << sheet.error().message;
    const double current = truth.dark_current_e_per_s[0];
    const double dark_variance =
        truth.read_noise_e * truth.read_noise_e + truth.row_noise_e * truth.row_noise_e + current;
    const double gain = truth.system_gain_dn_per_e;
    expect_near("gain", sheet->transfer.system_gain_dn_per_e, gain);
    expect_near("read noise", *sheet->transfer.read_noise_e, std::sqrt(dark_variance));
    expect_near("threshold", *sheet->threshold_e, std::sqrt(dark_variance + 1 / (12 * gain * gain) + 0.25) + 0.5);
    EXPECT_DOUBLE_EQ(sheet->snr_max->value, std::sqrt(sheet->saturation_e->value));
    EXPECT_DOUBLE_EQ(sheet->dynamic_range->value, sheet->saturation_e->value / sheet->threshold_e->value);
    expect_near("saturation", *sheet->saturation_e, isp::saturation_charge_e(truth));
    // Levels are up to 20 % apart, and evenly spread errors have 1 / sqrt(3) of that.
    EXPECT_LT(sheet->saturation_e->standard_error, 0.12 * isp::saturation_charge_e(truth));
    EXPECT_DOUBLE_EQ(sheet->snr_max->standard_error,
                     sheet->saturation_e->standard_error / (2 * std::sqrt(sheet->saturation_e->value)));
    expect_root("DSNU of rows", sheet->dsnu_e.row, 0);
    expect_root("DSNU of columns", sheet->dsnu_e.column, truth.column_noise_e);
    expect_root("DSNU of pixels", sheet->dsnu_e.pixel, truth.dsnu * current);
    expect_root("DSNU", sheet->dsnu_e.total, std::hypot(truth.column_noise_e, truth.dsnu * current));
    expect_root("PRNU of rows", sheet->prnu->row, 0);
    expect_root("PRNU of columns", sheet->prnu->column, 0);
    expect_root("PRNU of pixels", sheet->prnu->pixel, truth.prnu);
    ASSERT_TRUE(sheet->dark_rates);
    ASSERT_EQ(sheet->dark_rates->rates.size(), 2u);
    for (const DarkRate& rate : sheet->dark_rates->rates) {
      const double expected = current * std::exp2((*rate.temperature_c - 20) / truth.dark_doubling_c);
      expect_near("dark current by mean", rate.by_mean_e_per_s, expected);
      expect_near("dark current by variance", rate.by_variance_e_per_s, expected);
      EXPECT_EQ(rate.exposures, 3);
    }
    expect_near("doubling", *sheet->dark_rates->doubling_c, truth.dark_doubling_c);
    for (std::size_t c = 0; c < 3; ++c) {
      expect_near("quantum efficiency", (*sheet->quantum_efficiency)[c], efficiency * std::array{0.75, 1.0, 0.9}[c]);
    }
    EXPECT_LT(*sheet->transfer.linearity_error, 0.02);
  }
}

/// A sensor whose dark current and its nonuniformity are a large part of long exposures.
SensorModel warm_sensor(std::mt19937_64& random) {
  SensorModel out = drawn_sensor(random);
  out.dark_current_e_per_s.fill(30);
  out.dsnu = 0.1;
  out.prnu = 0.003;
  out.row_noise_e = 0;
  out.full_well_e = 30000;
  return out;
}

/// Takes flats of 0.1 to 3.2 s, and darks of the given times; PRNU has the flats of 3.2 s.
SheetFrames shoot_long(SensorBench bench, const std::vector<double>& times_of_darks_s) {
  SheetFrames out;
  std::uint32_t frame = 0;
  for (const double time_s : times_of_darks_s) {
    out.darks.push_back(stack_of(bench, {time_s, 20}, frame));
    frame += stack_frames;
  }
  for (int i = 0; i < 4; ++i, frame += 2)
    out.dark_pairs.push_back(pair_at(bench, {times_of_darks_s.front(), 20}, frame));
  bench.rate_e_per_s = {800, 1600, 1200};
  out.irradiance = irradiance_of(1600);
  for (const double time_s : {0.1, 0.2, 0.4, 0.8, 1.6, 3.2}) {
    for (int i = 0; i < 2; ++i, frame += 2) out.flat_pairs.push_back(pair_at(bench, {time_s, 20}, frame));
  }
  out.bright = stack_of(bench, {3.2, 20}, frame);
  return out;
}

void expect_efficiency(const DataSheet& sheet) {
  for (std::size_t c = 0; c < 3; ++c) {
    const Estimate& found = (*sheet.quantum_efficiency)[c];
    expect_near("quantum efficiency", found, efficiency * std::array{0.5, 1.0, 0.75}[c]);
    EXPECT_LT(found.standard_error, 0.01 * found.value);
  }
}

TEST(DataSheet, DarksOfTheFlatsExposureTimeAreSubtracted) {
  std::mt19937_64 random(first_seed);
  for (int round = 0; round < 3; ++round) {
    const SensorBench bench{.sensor = warm_sensor(random), .width = 256, .height = 192, .seed = random()};
    SCOPED_TRACE(testing::Message() << "round " << round << ", seed " << bench.seed);
    const auto sheet = make_data_sheet(shoot_long(bench, {0.001, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2}));
    ASSERT_TRUE(sheet) << sheet.error().message;
    EXPECT_EQ(sheet->warnings, std::vector<std::string>{});
    expect_efficiency(*sheet);
    // Shot noise of 8 frames of 1000 to 5000 e- in 12,288 pixels of a site leaves 10 to 20 % of this PRNU's square.
    expect_root("PRNU of pixels", sheet->prnu->pixel, bench.sensor.prnu);
    EXPECT_LT(sheet->prnu->pixel.standard_error, 0.15 * bench.sensor.prnu);
  }
}

TEST(DataSheet, DarkCurrentStandsInForMissingDarks) {
  std::mt19937_64 random(first_seed);
  const SensorBench bench{.sensor = warm_sensor(random), .width = 256, .height = 192, .seed = random()};
  const auto sheet = make_data_sheet(shoot_long(bench, {0.001, 2}));
  ASSERT_TRUE(sheet) << sheet.error().message;
  expect_efficiency(*sheet);
  ASSERT_EQ(sheet->warnings.size(), 1u);
  EXPECT_EQ(
      sheet->warnings[0],
      "the non-uniformity of dark current is not subtracted from PRNU, because two darks of the flats' 3.2 s at 20 "
      "C are missing; take 16 darks of the exposure time of the flats near half of saturation");
}

TEST(DataSheet, FiguresThatContainDarkCurrentAreWarnedOf) {
  std::mt19937_64 random(first_seed);
  const SensorBench bench{.sensor = warm_sensor(random), .width = 128, .height = 128, .seed = random()};
  SheetFrames frames = shoot_long(bench, {0.001});
  const auto few = make_data_sheet(frames);
  ASSERT_TRUE(few) << few.error().message;
  ASSERT_EQ(few->warnings.size(), 2u);
  EXPECT_EQ(few->warnings[1].find("dark current is not subtracted for the quantum efficiency"), 0u) << few->warnings[1];
  // 30 e-/s of dark current next to 1600 e-/s of light.
  EXPECT_GT((*few->quantum_efficiency)[1].value, efficiency * 1.015);
  // Darks of the flats' time, but 3 degrees warmer, are those of another dark current.
  frames = shoot_long(bench, {0.001, 3.2});
  frames.darks.back().setting.temperature_c = 23;
  const auto warm = make_data_sheet(frames);
  ASSERT_TRUE(warm) << warm.error().message;
  EXPECT_EQ(warm->warnings.size(), 2u);
}

// Darks that fill the pixels determine no current: with them, that of their temperature would be far too low.
TEST(DataSheet, SaturatedDarksAreLeftOut) {
  std::mt19937_64 random(first_seed + 7);
  for (int round = 0; round < 3; ++round) {
    const SensorModel truth = drawn_sensor(random);
    const SensorBench bench{.sensor = truth, .width = 192, .height = 128, .seed = random()};
    SCOPED_TRACE(testing::Message() << "seed " << first_seed + 7 << ", round " << round);
    SheetFrames frames = shoot(bench);
    const double full_s = std::round(1.5 * truth.full_well_e / isp::dark_mean_e(truth, {1, 32})[1]);
    frames.darks.push_back(stack_of(bench, {full_s, 32}, 5000));
    const auto sheet = make_data_sheet(frames);
    ASSERT_TRUE(sheet) << sheet.error().message;
    const std::string left_out =
        fmt::format("the darks of {:g} s at 32 C are saturated: dark current is measured without them", full_s);
    EXPECT_EQ(std::ranges::count(sheet->warnings, left_out), 1);
    ASSERT_TRUE(sheet->dark_rates);
    ASSERT_EQ(sheet->dark_rates->rates.size(), 2u);
    EXPECT_EQ(sheet->dark_rates->rates[1].exposures, 3);
    for (const DarkRate& rate : sheet->dark_rates->rates) {
      const double e_per_s = isp::dark_mean_e(truth, {1, *rate.temperature_c})[1];
      expect_near("dark current by mean", rate.by_mean_e_per_s, e_per_s);
      expect_near("dark current by variance", rate.by_variance_e_per_s, e_per_s);
    }
    expect_near("doubling", *sheet->dark_rates->doubling_c, truth.dark_doubling_c);
  }
}

TEST(DataSheet, SaturatedHotPixelsAreWarnedOf) {
  std::mt19937_64 random(first_seed + 8);
  SensorModel truth = drawn_sensor(random);
  truth.hot_pixel_fraction = 0.004;
  truth.hot_pixel_current_e_per_s = truth.full_well_e;
  const SensorBench bench{.sensor = truth, .width = 192, .height = 128, .seed = random()};
  const auto sheet = make_data_sheet(shoot(bench));
  ASSERT_TRUE(sheet) << sheet.error().message;
  const auto warns = [&](const std::string& text) {
    return std::ranges::any_of(sheet->warnings, [&](const std::string& w) { return w.find(text) != w.npos; });
  };
  EXPECT_TRUE(warns("of the pixels are saturated in the darks of 10 s at 32 C")) << "seed " << first_seed + 8;
  EXPECT_FALSE(warns("are saturated: dark current is measured without them"));
  EXPECT_EQ(sheet->dark_rates->rates[1].exposures, 3);
}

TEST(DataSheet, FlickerOfTheLampChangesNoPrnu) {
  constexpr double prnu = 0.003;
  std::mt19937_64 random(first_seed);
  for (const double flicker : {0.0, 0.005, 0.016}) {
    SensorModel sensor = warm_sensor(random);
    sensor.dark_current_e_per_s.fill(0);
    SensorBench bench{.sensor = sensor, .width = 256, .height = 192, .seed = random()};
    SCOPED_TRACE(testing::Message() << "flicker " << flicker << ", seed " << bench.seed);
    const auto dark = spatial_parts(stack_of(bench, {1, 20}, 0));
    DarkStack flats(StackedFrames::flats);
    for (std::uint32_t i = 0; i < 16; ++i) {
      bench.rate_e_per_s.fill(15000 * (1 + flicker * std::uniform_real_distribution<double>(-1, 1)(random)));
      ASSERT_TRUE(flats.add(bench.frame({1, 20}, 100 + i)));
    }
    const auto bright = spatial_parts(*flats.group());
    ASSERT_TRUE(dark && bright);
    const Nonuniformity found = photo_response_nonuniformity(*bright, *dark);
    expect_root("PRNU of pixels", found.pixel, prnu);
    EXPECT_LT(found.pixel.standard_error, 0.03 * prnu);
    expect_root("PRNU of rows", found.row, 0);
  }
}

TEST(DarkRates, DriftOfTheTemperatureChangesNoVariance) {
  std::mt19937_64 random(first_seed);
  const SensorModel sensor = warm_sensor(random);
  const SensorBench bench{.sensor = sensor, .width = 256, .height = 192, .seed = random()};
  std::vector<DarkGroup> groups;
  std::uint32_t frame = 0;
  for (const double time_s : {0.1, 3.2, 6.4}) {
    DarkStack stack;
    for (int i = 0; i < stack_frames; ++i, ++frame) {
      RawDn raw = bench.frame({time_s, 19.5 + i / (stack_frames - 1.0)}, frame);
      raw.info.temperature_c = 20;
      ASSERT_TRUE(stack.add(raw));
    }
    groups.push_back(*stack.group());
  }
  const auto rates = dark_rates(groups, {sensor.system_gain_dn_per_e, 1e-4 * sensor.system_gain_dn_per_e});
  ASSERT_TRUE(rates) << rates.error().message;
  double current = 0;  // mean over the drift
  for (int i = 0; i < stack_frames; ++i) {
    current += 30 * std::exp2((i / (stack_frames - 1.0) - 0.5) / sensor.dark_doubling_c) / stack_frames;
  }
  expect_near("by variance", rates->rates[0].by_variance_e_per_s, current);
  EXPECT_LT(rates->rates[0].by_variance_e_per_s.standard_error, 0.02 * current);
  expect_near("by mean", rates->rates[0].by_mean_e_per_s, current);
}

// A wrong gain scales the currents of all temperatures alike: energy and doubling do not depend on it.
TEST(DarkRates, ErrorsOfTheLawAreItsScatterAlthoughTheGainHasAnErrorToo) {
  constexpr int rounds = 400;
  constexpr double gain_error = 0.01, activation_ev = 0.6;
  std::mt19937_64 random(first_seed + 3);
  std::normal_distribution<double> normal;
  double squares = 0, doubling_squares = 0, mean_doubling_error = 0;
  for (int round = 0; round < rounds; ++round) {
    SensorModel sensor = warm_sensor(random);
    sensor.dsnu = 0;
    sensor.column_noise_e = 0;
    const bool doubles = round % 2 == 0;
    if (!doubles) sensor.dark_activation_ev = activation_ev;
    const SensorBench bench{.sensor = sensor, .width = 64, .height = 64, .seed = random()};
    std::vector<DarkGroup> groups;
    std::uint32_t frame = 0;
    for (const double celsius : {0.0, 10.0, 20.0, 30.0, 40.0}) {
      for (const double time_s : {0.1, 10.0}) {
        groups.push_back(stack_of(bench, {time_s, celsius}, frame));
        frame += stack_frames;
      }
    }
    const double gain = sensor.system_gain_dn_per_e * (1 + gain_error * normal(random));
    const auto rates = dark_rates(groups, {gain, gain_error * gain});
    ASSERT_TRUE(rates) << rates.error().message;
    ASSERT_TRUE((doubles || rates->law) && rates->doubling_c) << "round " << round << ", seed " << bench.seed;
    const Estimate& doubling = *rates->doubling_c;
    if (doubles) {
      mean_doubling_error += doubling.standard_error / doubling.value / (rounds / 2.0);
      doubling_squares += std::pow((doubling.value - sensor.dark_doubling_c) / doubling.standard_error, 2);
      continue;
    }
    const Estimate& energy = rates->law->activation_ev;
    squares += std::pow((energy.value - activation_ev) / energy.standard_error, 2) / (rounds / 2.0);
    // Arrhenius' law doubles over 6.4 K at 0 C and over 9.8 K at 40 C: no doubling holds at both to better than a
    // fifth.
    EXPECT_GT(doubling.standard_error, 0.01 * doubling.value);
    EXPECT_LT(doubling.standard_error, 0.2 * doubling.value);
  }
  EXPECT_NEAR(squares, 1, 5 * std::sqrt(2.0 / (rounds / 2.0))) << "seed " << first_seed + 3;
  EXPECT_NEAR(doubling_squares / (rounds / 2.0), 1, 5 * std::sqrt(2.0 / (rounds / 2.0))) << "seed " << first_seed + 3;
  EXPECT_LT(mean_doubling_error, gain_error / 10);  // frames of 30 e-/s determine it to 0.03 %
}

TEST(DataSheet, FiguresThatTheFramesDoNotDetermineAreAbsent) {
  std::mt19937_64 random(first_seed);
  SheetFrames frames = shoot({.sensor = drawn_sensor(random), .width = 128, .height = 128});
  frames.darks.resize(1);
  frames.bright.reset();
  frames.irradiance.reset();
  const auto sheet = make_data_sheet(frames);
  ASSERT_TRUE(sheet) << sheet.error().message;
  EXPECT_FALSE(sheet->dark_rates || sheet->prnu || sheet->quantum_efficiency || sheet->transfer.linearity_error);
}

TEST(DataSheet, DarksOfAnotherCameraAreAnError) {
  std::mt19937_64 random(first_seed);
  SheetFrames frames = shoot({.sensor = drawn_sensor(random), .width = 128, .height = 128});
  frames.darks.back().setting.model += " II";
  const auto sheet = make_data_sheet(frames);
  ASSERT_FALSE(sheet);
  EXPECT_NE(sheet.error().code, ErrorCode::insufficient);
}

TEST(DataSheet, PhotonsAreThoseOfEmvasEquation) {
  // EMVA 1288 R4 Eq. 4: 50.34 A[um2] t[ms] lambda[um] E[uW/cm2].
  EXPECT_NEAR(photons_of({.w_per_m2 = 0.01, .wavelength_nm = 1000, .pixel_um2 = 1}, 1e-3), 50.34, 0.005);
}

TEST(SpatialParts, IntervalsOfRootsHoldTheTruthFromZeroOn) {
  std::mt19937_64 random(first_seed + 4);
  std::normal_distribution<double> normal;
  constexpr int rounds = 4000;
  for (const double truth : {0.0, 0.3, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 100.0}) {  // variance in standard errors
    int held = 0;
    for (int round = 0; round < rounds; ++round) {
      const Estimate root = root_of({truth + normal(random), 1});
      held += std::fabs(root.value - std::sqrt(truth)) <= 1.96 * root.standard_error;
    }
    EXPECT_GE(held, rounds * 0.95 - 5 * std::sqrt(rounds * 0.95 * 0.05)) << truth << ", seed " << first_seed + 4;
  }
}

TEST(SpatialParts, RowsColumnsAndPixelsAreSeparated) {
  std::mt19937_64 random(first_seed);
  for (int round = 0; round < 8; ++round) {
    const int half = round / 2, quarter = round / 4;
    const double row = 3.0 * (round % 2), column = 2.0 * (half % 2), pixel = 1.0 + quarter;
    SCOPED_TRACE(testing::Message() << "row " << row << ", column " << column << ", pixel " << pixel);
    std::normal_distribution<double> normal;
    DarkGroup group{.frames = 4, .mean_dn = Plane<float>(200, 160), .variance_dn2 = Plane<float>(200, 160)};
    std::fill_n(group.variance_dn2.data(), group.variance_dn2.size(), 0.0F);
    std::vector<double> of_row(160), of_column(200);
    for (double& r : of_row) r = row * normal(random);
    for (double& c : of_column) c = column * normal(random);
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 200; ++x) {
        group.mean_dn.at(x, y) = static_cast<float>(100 + of_row[static_cast<std::size_t>(y)] +
                                                    of_column[static_cast<std::size_t>(x)] + pixel * normal(random));
      }
    }
    const auto parts = spatial_parts(group);
    ASSERT_TRUE(parts);
    for (const SpatialParts& site : *parts) {
      expect_near("row", site.row_dn2, row * row);
      expect_near("column", site.column_dn2, column * column);
      expect_near("pixel", site.pixel_dn2, pixel * pixel);
    }
  }
}

}  // namespace
}  // namespace lowlux::calib::data_sheet_test
