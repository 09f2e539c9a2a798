#include "calib/sheet/dark_rates.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "isp/model/sensor/noise_budget.h"

namespace lowlux::calib {
namespace {

constexpr std::uint64_t first_seed = 4201;

SensorModel sensor_of(double activation_ev, double floor_e_per_s) {
  SensorModel out{.dark_temperature_c = 20};
  out.dark_activation_ev = activation_ev;
  out.dark_floor_e_per_s = floor_e_per_s;
  out.dark_current_e_per_s.fill(floor_e_per_s + 1);
  return out;
}

/// Rates that the simulator's law gives, each with the error of so many parts of its square root.
std::vector<RateAtTemperature> rates_of(const SensorModel& sensor, const std::vector<double>& temperatures_c,
                                        double relative_error) {
  std::vector<RateAtTemperature> out;
  for (const double celsius : temperatures_c) {
    const double rate = isp::dark_mean_e(sensor, {1, celsius})[1];
    out.push_back({celsius, {rate, relative_error * std::sqrt(rate)}});
  }
  return out;
}

TEST(DarkLaw, OfExactRatesIsTheLawOfTheSimulator) {
  std::mt19937_64 random(first_seed);
  std::uniform_real_distribution<double> energy(0.3, 1.3), start(-20, 20), step(4, 20);
  for (int round = 0; round < 40; ++round) {
    const double activation_ev = energy(random), floor = round % 2 == 0 ? 0 : std::exp(4 * energy(random) - 4);
    std::vector<double> celsius{start(random)};
    while (celsius.size() < 3u + static_cast<std::size_t>(round) % 4) celsius.push_back(celsius.back() + step(random));
    SCOPED_TRACE(testing::Message() << activation_ev << " eV, floor " << floor << ", " << celsius.size() << " from "
                                    << celsius.front() << " to " << celsius.back() << " C");
    const auto law = fit_dark_law(rates_of(sensor_of(activation_ev, floor), celsius, 1e-4));
    ASSERT_TRUE(law);
    EXPECT_NEAR(law->activation_ev.value, activation_ev, 1e-4);  // eV: of the search
    EXPECT_NEAR(law->floor_e_per_s.value, floor, 0.05 * law->floor_e_per_s.standard_error + 1e-6);
  }
}

TEST(DarkLaw, ErrorsAreTheScatterOfNoisyRates) {
  const double activation_ev = 0.65, floor = 0.4;
  std::mt19937_64 random(first_seed + 1);
  std::normal_distribution<double> normal;
  constexpr int rounds = 1000;
  std::array<double, 2> squares{}, sums{};
  const auto exact = rates_of(sensor_of(activation_ev, floor), {-10, 5, 20, 35, 50}, 0.02);
  for (int round = 0; round < rounds; ++round) {
    auto rates = exact;
    for (RateAtTemperature& r : rates) r.e_per_s.value += r.e_per_s.standard_error * normal(random);
    const auto law = fit_dark_law(rates);
    ASSERT_TRUE(law);
    const std::array off{(law->activation_ev.value - activation_ev) / law->activation_ev.standard_error,
                         (law->floor_e_per_s.value - floor) / law->floor_e_per_s.standard_error};
    for (std::size_t i = 0; i < 2; ++i) {
      sums[i] += off[i];
      squares[i] += off[i] * off[i];
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(sums[i] / rounds, 0, 5 / std::sqrt(rounds));           // of standard errors
    EXPECT_NEAR(squares[i] / rounds, 1, 5 * std::sqrt(2.0 / rounds));  // five standard errors of a variance
  }
}

// A current that doubles every so many degrees has no floor, and an Arrhenius law with one fits it badly.
TEST(DarkLaw, IsAbsentWhereTheCurrentDoubles) {
  std::mt19937_64 random(first_seed + 2);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> doubling(5, 9), current(0.5, 20);
  int stated = 0;
  constexpr int rounds = 200;
  for (int round = 0; round < rounds; ++round) {
    const double every_c = doubling(random), at_0_c = current(random);
    std::vector<RateAtTemperature> rates;
    for (int i = 0; i < 3 + round % 3; ++i) {
      const double e_per_s = at_0_c * std::exp2(10 * i / every_c), error = 0.002 * e_per_s;
      rates.push_back({10.0 * i, {e_per_s + error * normal(random), error}});
    }
    stated += fit_dark_law(rates) ? 1 : 0;
  }
  EXPECT_LE(stated, rounds / 20) << "seed " << first_seed + 2;  // chance alone makes some of three temperatures
}

TEST(DarkLaw, IsAbsentWhereRatesDoNotDetermineIt) {
  const SensorModel sensor = sensor_of(0.65, 0.4);
  EXPECT_FALSE(fit_dark_law({}));
  EXPECT_FALSE(fit_dark_law(rates_of(sensor, {20}, 1e-3)));
  EXPECT_FALSE(fit_dark_law(rates_of(sensor, {20, 40}, 1e-3)));
  EXPECT_FALSE(fit_dark_law(rates_of(sensor, {20, 20.5, 40, 40.7}, 1e-3)));  // two temperatures, measured twice
  EXPECT_TRUE(fit_dark_law(rates_of(sensor, {0, 20, 40}, 1e-3)));
  EXPECT_FALSE(fit_dark_law(rates_of(sensor, {0, 20, 40}, 10)));  // only noise
  std::vector<RateAtTemperature> falling = rates_of(sensor, {0, 20, 40}, 1e-3);
  for (RateAtTemperature& r : falling) r.temperature_c = 40 - r.temperature_c;
  EXPECT_FALSE(fit_dark_law(falling));
  std::vector<RateAtTemperature> constant = rates_of(sensor, {0, 20, 40}, 1e-3);
  for (RateAtTemperature& r : constant) r.e_per_s = {1, 1e-3};
  EXPECT_FALSE(fit_dark_law(constant));
}

}  // namespace
}  // namespace lowlux::calib
