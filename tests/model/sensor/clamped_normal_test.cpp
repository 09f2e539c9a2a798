#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>

#include <boost/math/quadrature/gauss.hpp>

#include "isp/model/sensor/noise_budget.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

// Two laws of a noise budget near the ends of a range, against quadrature and sums over codes.
namespace lowlux::isp {
namespace {

using test::inf;

constexpr double eps = std::numeric_limits<double>::epsilon();

long double tail(long double z) { return 0.5L * std::erfc(z / std::numbers::sqrt2_v<long double>); }

/// Moments by 20-point Gauss-Legendre over panels of half a standard deviation, in long double, about the nearest
/// point of the range.
struct Reference {
  long double shift;     // mean less that point
  long double variance;  // relative error about 1e-17
};

Reference quadrature(double mean, double sd, double low, double high) {
  const long double centre = std::clamp(mean, low, high), m = mean, s = sd;
  // 25 standard deviations about the most probable place: beyond it is less than 1e-130 of what is inside.
  const long double from = std::max<long double>(low, std::min(m, centre) - 25 * s);
  const long double begin = std::max(from, centre - 25 * s), end = std::min<long double>(high, centre + 25 * s);
  const long double density = 1 / (s * std::sqrt(2 * std::numbers::pi_v<long double>));
  long double first = 0, second = 0;
  for (long double a = begin; a < end; a += s / 2) {
    const long double b = std::min(end, a + s / 2);
    const auto moment = [&](int power) {
      return boost::math::quadrature::gauss<long double, 20>::integrate(
          [&](long double x) {
            const long double z = (x - m) / s, d = x - centre;
            return (power == 1 ? d : d * d) * density * std::exp(-z * z / 2);
          },
          a, b);
    };
    first += moment(1);
    second += moment(2);
  }
  const auto at = [&](double bound, long double probability) {
    if (std::isinf(bound) || probability == 0) return;
    first += (bound - centre) * probability;
    second += (bound - centre) * (bound - centre) * probability;
  };
  at(low, tail((m - low) / s));
  at(high, tail((high - m) / s));
  return {first, second - first * first};
}

/// How far outside of the bounds the mean is [standard deviations].
double outside(double mean, double sd, double low, double high) {
  return std::max({0.0, (low - mean) / sd, (mean - high) / sd});
}

void expect_quadrature(double mean, double sd, double low, double high) {
  SCOPED_TRACE(testing::Message() << mean << " +- " << sd << " in " << low << ".." << high);
  const Moments found = clamped_normal({mean, sd * sd}, low, high);
  const Reference expected = quadrature(mean, sd, low, high);
  const double centre = std::clamp(mean, low, high);
  // What cancels: terms of s phi(a) in the mean's shift and of a s^2 phi(a) in the variance, a standard deviations
  // outside, where density and tail carry a^2 eps each. The sum with the bound rounds once more.
  const double a = outside(mean, sd, low, high);
  const double terms = eps * (1 + a * a) * std::exp(-0.5 * a * a);
  EXPECT_NEAR(found.mean, static_cast<double>(centre + expected.shift), 4 * terms * sd + 2 * eps * std::fabs(centre));
  EXPECT_NEAR(found.variance, static_cast<double>(expected.variance), 8 * terms * (1 + a) * sd * sd);
}

TEST(ClampedNormal, EqualsQuadratureInsideOutsideAndAtItsBounds) {
  for (const double sd : {0.05, 1.0, 30.0}) {
    for (const double at : test::steps(-12, 12, 0.75)) {
      const double mean = at * sd;
      expect_quadrature(mean, sd, 0, inf);
      expect_quadrature(mean, sd, -inf, 0);
      expect_quadrature(mean, sd, -sd, 2 * sd);
      expect_quadrature(mean, sd, -0.01 * sd, 0.01 * sd);
      expect_quadrature(mean, sd, -inf, inf);
    }
  }
}

TEST(ClampedNormal, KeepsItsDigitsFarOutsideOfItsBounds) {
  for (const double at : {15.0, 20.0, 30.0, 36.0}) {
    expect_quadrature(-at, 1, 0, inf);
    expect_quadrature(at, 1, -inf, 0);
    expect_quadrature(-at, 1, 0, 4095);
    expect_quadrature(4095 + at, 1, 0, 4095);
    EXPECT_GT(clamped_normal({-at, 1}, 0, inf).mean, 0);
    EXPECT_GT(clamped_normal({-at, 1}, 0, inf).variance, 0);
  }
}

TEST(ClampedNormal, BeyondWhatDoublesHoldItIsItsBound) {
  for (const double at : {50.0, 1e3, 1e150}) {
    const Moments low = clamped_normal({-at, 1}, 0, 10), high = clamped_normal({10 + at, 1}, 0, 10);
    EXPECT_EQ(low.mean, 0);
    EXPECT_EQ(high.mean, 10);
    EXPECT_NEAR(low.variance, 0, 1e-300);
    EXPECT_NEAR(high.variance, 0, 1e-300);
  }
}

TEST(ClampedNormal, WithoutVarianceIsTheMeanHeldBetweenTheBounds) {
  for (const double variance : {0.0, -1e-18}) {  // rounding may leave a variance below zero
    for (const auto& [mean, expected] : {std::pair{-1.0, 0.0}, {0.0, 0.0}, {3.0, 3.0}, {5.0, 5.0}, {6.0, 5.0}}) {
      const Moments found = clamped_normal({mean, variance}, 0, 5);
      EXPECT_EQ(found.mean, expected);
      EXPECT_EQ(found.variance, 0);
    }
    EXPECT_EQ(clamped_normal({-7, variance}, -inf, inf).mean, -7);
  }
}

TEST(ClampedNormal, WithoutBoundsIsItself) {
  const Moments found = clamped_normal({-3, 7}, -inf, inf);
  EXPECT_DOUBLE_EQ(found.mean, -3);
  EXPECT_NEAR(found.variance, 7, 8 * eps * 7);
}

// The mean of noise clipped at black is sigma / sqrt(2 pi) too high: 0.4 standard deviations.
TEST(ClampedNormal, LiftsTheMeanOfBlackByPointFourStandardDeviations) {
  const Moments found = clamped_normal({0, 16}, 0, inf);
  EXPECT_NEAR(found.mean, 4 / std::sqrt(2 * std::numbers::pi), 1e-14);
  EXPECT_NEAR(found.variance, 16 * (0.5 - 1 / (2 * std::numbers::pi)), 1e-13);
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Mean and variance of a rounded normal variable, by summing its codes.
Moments rounded(double mean, double sd) {
  Moments m;
  const int reach = static_cast<int>(std::ceil(10 * sd)) + 2;
  for (const int moment : {1, 2}) {
    for (int code = -reach; code <= reach; ++code) {
      const double p = normal_cdf((code + 0.5 - mean) / sd) - normal_cdf((code - 0.5 - mean) / sd);
      if (moment == 1) m.mean += p * code;
      if (moment == 2) m.variance += p * (code - m.mean) * (code - m.mean);
    }
  }
  return m;
}

TEST(QuantisationBounds, HoldAtEveryPositionBetweenCodesAndAreWithinTwiceTheWorst) {
  for (const double sd : test::steps(0.02, 1.2, 0.02)) {
    double worst_mean = 0, worst_variance = 0;
    for (const double mean : test::steps(-0.5, 0.5, 0.005)) {
      const Moments m = rounded(mean, sd);
      worst_mean = std::max(worst_mean, std::fabs(m.mean - mean));
      worst_variance = std::max(worst_variance, std::fabs(m.variance - sd * sd - 1.0 / 12));
    }
    const QuantisationBounds bounds = quantisation_bounds(sd);
    const double rounding = 1e-14;  // of the sums
    EXPECT_GE(bounds.mean_dn, worst_mean - rounding) << sd;
    EXPECT_GE(bounds.variance_dn2, worst_variance - rounding) << sd;
    if (sd < 1) {
      EXPECT_LE(bounds.mean_dn, 2 * worst_mean + rounding) << sd;
      EXPECT_LE(bounds.variance_dn2, 2 * worst_variance + rounding) << sd;
    }
  }
}

TEST(QuantisationBounds, WithoutNoiseAreHalfACodeAndItsSquareAndWithMuchNothing) {
  EXPECT_EQ(quantisation_bounds(0).mean_dn, 0.5);
  EXPECT_EQ(quantisation_bounds(0).variance_dn2, 0.25);
  EXPECT_EQ(quantisation_bounds(100).mean_dn, 0);
  EXPECT_EQ(quantisation_bounds(100).variance_dn2, 0);
}

}  // namespace
}  // namespace lowlux::isp
