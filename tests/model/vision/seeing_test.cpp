#include "isp/model/vision/seeing.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <cmath>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

double seen(double mean, int threshold) { return *frequency_of_seeing({mean, 1, 0}, threshold); }

// The sum that loses all digits in double, with 500 of them: 1 - sum over m < K of exp(-x) x^m / m!
double by_sum(double mean, int threshold) {
  using Exact = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<500>>;
  const Exact x = mean;
  Exact term = exp(-x), sum = 0;
  for (int m = 0; m < threshold; ++m) {
    sum += term;
    term *= x / (m + 1);
  }
  return static_cast<double>(1 - sum);
}

TEST(FrequencyOfSeeing, AgreesWithTheSumIn500DigitsDownToTinyProbabilities) {
  for (const int k : {1, 2, 5, 6, 7, 20, 100}) {
    for (const double x : {1e-2, 0.5, 1.0, 3.0, 6.0, 20.0, 99.5, 300.0}) {
      const double truth = by_sum(x, k);
      EXPECT_NEAR(seen(x, k), truth, 1e-12 * truth) << k << " " << x;  // relative: a few thousand roundings
    }
  }
  EXPECT_LT(by_sum(1e-2, 20), 1e-58);  // far below what 1 - sum can tell in double
}

TEST(FrequencyOfSeeing, OneIsomerisationHasTheExponentialClosedForm) {
  for (const double x : {1e-300, 1e-12, 0.1, 1.0, 30.0}) EXPECT_DOUBLE_EQ(seen(x, 1), -std::expm1(-x));
}

TEST(FrequencyOfSeeing, NothingIsNeverSeenAndMuchAlways) {
  EXPECT_EQ(seen(0, 1), 0);
  EXPECT_EQ(seen(0, 7), 0);
  EXPECT_EQ(seen(1e6, 7), 1);
  EXPECT_EQ(seen(1e-200, 7), 0);  // 1e-1403 is 0 in double
}

TEST(FrequencyOfSeeing, DarkIsomerisationsCountLikeThoseOfLight) {
  EXPECT_EQ(*frequency_of_seeing({30, 0.1, 2}, 5), seen(5, 5));
  EXPECT_EQ(*frequency_of_seeing({0, 0.1, 5}, 5), seen(5, 5));
}

TEST(FrequencyOfSeeing, FiguresOutsideTheirRangeAreRefused) {
  for (const double bad : {-1.0, nan, inf}) {
    EXPECT_FALSE(frequency_of_seeing({bad, 1, 0}, 5));
    EXPECT_FALSE(frequency_of_seeing({1, bad, 0}, 5));
    EXPECT_FALSE(frequency_of_seeing({1, 1, bad}, 5));
  }
  EXPECT_FALSE(frequency_of_seeing({1e200, 1e200, 0}, 5));
  EXPECT_FALSE(frequency_of_seeing({1, 1, 0}, 0));
  EXPECT_FALSE(frequency_of_seeing({1, 1, 0}, -3));
}

TEST(IsomerisationsSeenWith, IsTheInverse) {
  for (const int k : {1, 6, 50}) {
    for (const double p : {1e-9, 0.01, 0.5, 0.999}) {
      EXPECT_NEAR(seen(*isomerisations_seen_with(p, k), k), p, 1e-12 * p) << k << " " << p;
    }
  }
  for (const double bad : {0.0, 1.0, -0.1, 1.1, nan}) EXPECT_FALSE(isomerisations_seen_with(bad, 5)) << bad;
  EXPECT_FALSE(isomerisations_seen_with(0.5, 0));
}

TEST(RetinalPath, MultipliesItsLossesAndKeepsSmallDensities) {
  EXPECT_NEAR(*isomerisations_per_photon({0.5, 0.8, 1, 0.6}), 0.5 * 0.8 * 0.9 * 0.6, 1e-15);
  EXPECT_NEAR(*isomerisations_per_photon({1, 1, 1e-12, 1}), 1e-12 * std::log(10.0) * (1 - 0.5e-12 * std::log(10.0)),
              1e-26);
  EXPECT_EQ(*isomerisations_per_photon({1, 1, inf, 1}), 1);
  EXPECT_EQ(*isomerisations_per_photon({1, 1, 0, 1}), 0);
  for (const double bad : {-0.1, 1.1, nan}) {
    EXPECT_FALSE(isomerisations_per_photon({bad, 1, 1, 1}));
    EXPECT_FALSE(isomerisations_per_photon({1, bad, 1, 1}));
    EXPECT_FALSE(isomerisations_per_photon({1, 1, 1, bad}));
  }
  EXPECT_FALSE(isomerisations_per_photon({1, 1, -0.1, 1}));
  EXPECT_FALSE(isomerisations_per_photon({1, 1, nan, 1}));
}

}  // namespace
}  // namespace lowlux::isp
