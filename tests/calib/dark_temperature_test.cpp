#include "calib/dark/dark_temperature.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr unsigned seed = 20261131;

using Slopes = std::vector<std::array<Estimate, 3>>;

DarkSeries fitted(const std::vector<double>& celsius, const Slopes& slopes) {
  DarkSeries out;
  put_currents(celsius, slopes, true, {1, 0}, out);
  return out;
}

// One temperature deviates from the doubling by some percent; the currents of the coldest are uncertain by far more.
TEST(DarkTemperature, TheMisfitIsThatWhichErrorsDoNotExplain) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0.02, 0.06), cold_error(0.08, 0.18);
  const std::vector<double> celsius{0, 5, 15, 20, 25, 30, 35, 40, 45, 50};
  constexpr int rounds = 200;
  int too_large = 0, too_small = 0;
  for (int round = 0; round < rounds; ++round) {
    const double deviation = part(random), of_cold = cold_error(random);
    Slopes slopes;
    for (const double t : celsius) {
      std::array<Estimate, 3> colours{};
      for (Estimate& slope : colours) {
        const double exact = std::exp2((t - 20) / 6.5) * (t == 30 ? 1 + deviation : 1);
        const double error = exact * (t < 10 ? of_cold : 0.002);
        slope = {exact + error * normal(random), error};
      }
      slopes.push_back(colours);
    }
    const DarkSeries found = fitted(celsius, slopes);
    ASSERT_TRUE(found.law);
    EXPECT_GT(found.law->reduced_chi_square, 3);
    too_large += found.law->misfit > 1.2 * deviation;
    too_small += found.law->misfit < 0.6 * deviation;  // the fit follows the deviation in part
  }
  // Two cold temperatures exceed three standard errors in 0.54 % of the rounds: 1.08 of 200, with five standard errors.
  EXPECT_LE(too_large, 1.08 + 5 * std::sqrt(1.08)) << "seed " << seed;
  EXPECT_EQ(too_small, 0) << "seed " << seed;
}

TEST(DarkTemperature, TheLawNamesTheTemperaturesThatItWasFittedTo) {
  const std::vector<double> celsius{-20, 10, 20, 30, 40};
  Slopes slopes;
  for (const double t : celsius) {
    const double exact = std::exp2((t - 20) / 6.5);
    slopes.push_back({Estimate{exact, 0.01}, {exact, 0.01}, {exact, 0.01}});
  }
  const DarkSeries found = fitted(celsius, slopes);
  ASSERT_TRUE(found.law);
  EXPECT_EQ(found.law->lowest_c, 10) << "the current at -20 C is 0.014 +- 0.01 DN/s";
  EXPECT_EQ(found.law->highest_c, 40);
  EXPECT_EQ(found.currents.size(), 5u);
}

}  // namespace
}  // namespace lowlux::calib
