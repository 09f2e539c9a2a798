#include "isp/bench/peers/gat_denoise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::denoise {
namespace {

using test::inf;
using test::nan;

struct Moments {
  long double mean = 0, second = 0;
  double std() const { return static_cast<double>(std::sqrt(second - mean * mean)); }
};

/// Moments of f(y) over the mixture, in long double and in y itself: z = y - edge is integrated as z = w^3, which makes
/// the root at the edge a smooth w^(3/2) w^2 and needs no trick of the code under test. 1000 midpoints,
/// 11 standard deviations to either side; below the edge f is 0.
Moments moments_of_f(long double lambda, long double sigma) {
  Moments out;
  long double probability = std::exp(-lambda);
  const int last = static_cast<int>(lambda + 12 * std::sqrt(lambda) + 30);
  for (int j = 0; j <= last; probability *= lambda / ++j) {
    const long double edge = j + 0.375L + sigma * sigma;  // distance of the count from the root's edge
    if (sigma == 0) {
      out.mean += probability * 2 * std::sqrt(edge);
      out.second += probability * 4 * edge;
      continue;
    }
    const long double begin = std::cbrt(std::max(edge - 11 * sigma, 0.0L)), end = std::cbrt(edge + 11 * sigma);
    const int steps = 1000;
    const long double h = (end - begin) / steps;
    long double mean = 0, second = 0;
    for (int i = 0; i < steps; ++i) {
      const long double w = begin + (i + 0.5L) * h, z = w * w * w;
      const long double x = (z - edge) / sigma;
      const long double density = std::exp(-x * x / 2) * 3 * w * w;
      mean += density * 2 * std::sqrt(z);
      second += density * 4 * z;
    }
    const long double scale = probability * h / (sigma * std::sqrt(2 * std::numbers::pi_v<long double>));
    out.mean += mean * scale;
    out.second += second * scale;
  }
  return out;
}

constexpr double sigmas[] = {0, 0.5, 1, 1.5, 4};

TEST(Gat, HasThePublishedStandardDeviationsByExactSummation) {
  // Published from 2e6 draws. Tolerance: half of the last digit, and three standard errors s / sqrt(2 * 2e6).
  const double lambdas[] = {0.1, 0.5, 1, 2, 4, 10, 50};
  const std::array<double, 7> published[] = {{0.344, 0.683, 0.847, 0.961, 1.000, 1.000, 1.001},
                                             {0.760, 0.889, 0.964, 1.010, 1.010, 1.002, 1.001},
                                             {0.989, 1.023, 1.040, 1.044, 1.023, 1.004, 1.001},
                                             {1.084, 1.082, 1.075, 1.058, 1.029, 1.005, 1.000},
                                             {1.021, 1.020, 1.018, 1.016, 1.011, 1.007, 1.001}};
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 7; ++k) {
      const double found = moments_of_f(lambdas[k], sigmas[i]).std();
      EXPECT_NEAR(found, published[i][k], 0.0005 + 3 * found / std::sqrt(4e6)) << sigmas[i] << ' ' << lambdas[k];
    }
  }
}

TEST(Gat, MeanAgreesWithQuadratureInLongDouble) {
  for (const double sigma : {0.0, 1e-7, 1e-5, 0.05, 0.3, 0.5, 1.0, 1.5, 4.0, 15.0}) {
    for (const double lambda : {0.0, 1e-4, 0.1, 1.0, 4.0, 60.0}) {
      const auto expected = static_cast<double>(moments_of_f(lambda, sigma).mean);
      // Of f: the reference's midpoints end at the edge, where they err by up to 1.4e-9.
      EXPECT_NEAR(gat_mean(lambda, sigma), expected, 3e-9) << sigma << ' ' << lambda;
    }
  }
}

TEST(Gat, MeanHasNoVisibleStepWhereTheAsymptoticFormTakesOver) {
  for (const double sigma : {0.0, 4.0, 17.0}) {
    const double lambda = 300 - sigma * sigma;
    const double below = gat_mean(std::nextafter(lambda, 0.0) - 1e-9, sigma), above = gat_mean(lambda, sigma);
    EXPECT_NEAR(below * below / 4, above * above / 4, 5e-4) << sigma;  // e-, as stated: sigma^2 / (8 * 300^2)
  }
  EXPECT_NEAR(gat_mean(1e12, 3) / 2e6, 1, 1e-11);  // 9 / 2e12, relative
}

TEST(Gat, ForwardIsTheAnscombeTransformAndZeroBelowTheRoot) {
  EXPECT_DOUBLE_EQ(gat_forward(0, 0), 2 * std::sqrt(0.375));
  EXPECT_DOUBLE_EQ(gat_forward(5, 2), 2 * std::sqrt(9.375));
  EXPECT_DOUBLE_EQ(gat_forward(-1, 1), 2 * std::sqrt(0.375));  // values below zero are data
  EXPECT_EQ(gat_forward(-10, 1), 0);
  EXPECT_DOUBLE_EQ(gat_forward(1e30, 0), 2e15);
}

struct Biases {
  double algebraic_low = inf, algebraic_high = -inf, asymptotic = 0, closed_form = 0, exact = 0;
};

/// Largest biases T(E[f]) - lambda of the inverses T over lambda.
Biases biases_of(double sigma, double first_e) {
  const GatTable table = gat_table(sigma);
  Biases out;
  for (const double lambda : test::ratios(first_e, 1e4, 1.11)) {
    const double d = gat_mean(lambda, sigma);
    const double algebraic = d * d / 4 - 0.375 - sigma * sigma - lambda;
    out.algebraic_low = std::min(out.algebraic_low, algebraic);
    out.algebraic_high = std::max(out.algebraic_high, algebraic);
    const auto worst = [&](double& largest, double found) { largest = std::max(largest, std::abs(found - lambda)); };
    worst(out.asymptotic, gat_inverse_asymptotic(d, sigma));
    worst(out.closed_form, gat_inverse_closed_form(d, sigma));
    worst(out.exact, gat_inverse_exact(table, d));
  }
  return out;
}

TEST(GatInverse, HasTheStatedBiases) {
  for (const double sigma : sigmas) {
    const Biases from_4 = biases_of(sigma, 4);
    EXPECT_NEAR(from_4.algebraic_low, -0.25, 0.03) << sigma;  // e-: squaring f alone loses a quarter of an electron
    EXPECT_NEAR(from_4.algebraic_high, -0.25, 1e-3) << sigma;
    const Biases all = biases_of(sigma, 1e-3);
    EXPECT_LE(all.closed_form, 0.042) << sigma;
    EXPECT_LT(all.exact, 1e-3) << sigma;
    std::printf("  sigma %g: asymptotic %.3f, closed form %.3f, exact %.1e e-\n", sigma, all.asymptotic,
                all.closed_form, all.exact);
    if (sigma >= 1) {
      EXPECT_LT(biases_of(sigma, 0.5).asymptotic, 0.03) << sigma;
      EXPECT_LT(all.asymptotic, 0.055) << sigma;
    }
  }
  EXPECT_NEAR(gat_inverse_asymptotic(gat_mean(0.1, 0), 0) - 0.1, 0.22, 0.005);  // half of the last digit
}

TEST(GatInverse, ExactHasLessThanItsStatedBiasOfTheReferenceMeanForAnyReadNoise) {
  for (const double sigma : {0.0, 0.01, 0.2, 0.35, 0.5, 0.8, 1.0, 1.5, 2.5, 4.0, 12.0, 20.0}) {
    const GatTable table = gat_table(sigma);
    for (const double lambda : {0.002, 0.07, 0.33, 1.1, 2.7, 9.0, 44.0, 130.0}) {
      const auto d = static_cast<double>(moments_of_f(lambda, sigma).mean);
      EXPECT_NEAR(gat_inverse_exact(table, d), lambda, 1e-3) << sigma << ' ' << lambda;
    }
  }
}

TEST(GatInverse, ExactIsMonotoneAndContinuousThroughBothEnds) {
  for (const double sigma : {0.0, 1e-3, 0.5, 1.5, 4.0, 17.28, 17.3, 17.33, 1000.0}) {
    const GatTable table = gat_table(sigma);
    for (std::size_t i = 1; i < table.stabilised.size(); ++i) {
      ASSERT_GT(table.stabilised[i], table.stabilised[i - 1]) << sigma << ' ' << i;
      ASSERT_GT(table.mean_e[i], table.mean_e[i - 1]) << sigma << ' ' << i;
    }
    double before = 0;
    const double middle = 2 * std::sqrt(sigma * sigma + 0.125);
    for (const double d : test::steps(0.8 * middle, 1.2 * middle + 40, 0.003)) {
      const double here = gat_inverse_exact(table, d);
      ASSERT_GE(here, before) << sigma << ' ' << d;
      ASSERT_LE(here - before, 0.003 * d / 2 * 3 + 1e-9) << sigma << ' ' << d;  // slope d / 2 far out, steeper below
      before = here;
    }
  }
}

TEST(GatInverse, BelowTheMeanOfNoLightIsZero) {
  for (const double sigma : sigmas) {
    const GatTable table = gat_table(sigma);
    const double dark = gat_mean(0, sigma);
    EXPECT_EQ(gat_inverse_exact(table, dark), 0) << sigma;
    EXPECT_EQ(gat_inverse_exact(table, 0.5 * dark), 0) << sigma;
    EXPECT_EQ(gat_inverse_exact(table, -3), 0) << sigma;
    EXPECT_GT(gat_inverse_exact(table, dark + 1e-6), 0) << sigma;
    EXPECT_EQ(gat_inverse_asymptotic(0, sigma), 0);
    EXPECT_EQ(gat_inverse_closed_form(0, sigma), 0);
  }
}

TEST(GatInverse, TakesHugeAndSenselessValues) {
  for (const double sigma : {0.0, 2.0, 1e3}) {
    const GatTable table = gat_table(sigma);
    EXPECT_NEAR(gat_inverse_exact(table, 2e8) / 1e16, 1, 1e-9);  // sigma^2 of 1e16
    EXPECT_EQ(gat_inverse_exact(table, inf), inf);
    EXPECT_EQ(gat_inverse_exact(table, nan), 0);
    EXPECT_EQ(gat_inverse_asymptotic(nan, sigma), 0);
    EXPECT_EQ(gat_inverse_closed_form(nan, sigma), 0);
    EXPECT_EQ(gat_inverse_exact(table, -inf), 0);
  }
}

}  // namespace
}  // namespace lowlux::denoise
