#include "isp/model/colour/chroma_bound.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace lowlux::isp {
namespace {

using test::inf;

/// The same information from another form of it: with dp/dlambda = p(y - 1) - p(y), J = int p(y - 1)^2 / p(y) dy - 1.
/// In long double, steps four times as fine as those under test and a wider range.
double reference_information(double lambda, double sigma) {
  using Real = long double;
  const Real mean = lambda, s = sigma;
  const Real step = std::min(s / 8, std::numbers::pi_v<Real> * s * s / 12);
  const int first = static_cast<int>(std::max(0.0, std::floor(lambda - 10 * std::sqrt(lambda) - 10)));
  const int last = static_cast<int>(std::ceil(lambda + 10 * std::sqrt(lambda) + 25));
  std::vector<Real> log_p;
  log_p.reserve(static_cast<std::size_t>(last - first + 1));
  Real log_factorial = 0;
  for (int n = 2; n <= first; ++n) log_factorial += std::log(static_cast<Real>(n));
  for (int j = first; j <= last; ++j) {
    if (j > first && j > 1) log_factorial += std::log(static_cast<Real>(j));
    log_p.push_back(j * std::log(mean) - mean - log_factorial);
  }
  const auto density = [&](Real y) {
    const int from = std::max(first, static_cast<int>(std::floor(y - 12 * s - 2)));
    const int to = std::min(last, static_cast<int>(std::ceil(y + 12 * s + 2)));
    Real sum = 0;
    for (int j = from; j <= to; ++j) {
      const Real z = (y - j) / s;
      sum += std::exp(log_p[static_cast<std::size_t>(j - first)] - z * z / 2);
    }
    return sum;
  };
  const Real begin = first - 11 * s;
  const auto steps = static_cast<int>((last + 11 * s - begin) / step);
  Real sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const Real y = begin + i * step, p = density(y), shifted = density(y - 1);
    if (p > 0) sum += shifted * shifted / p;
  }
  return static_cast<double>(sum * step / (s * std::sqrt(2 * std::numbers::pi_v<Real>)) - 1);
}

double efficiency(double lambda, double sigma) {
  return 1 / (fisher_information_e2(lambda, sigma) * (lambda + sigma * sigma));
}

TEST(FisherInformation, OfThePoissonGaussMixtureAgreesWithAnotherFormInLongDouble) {
  for (const double sigma : {0.2, 0.3, 0.5, 1.0, 1.5, 3.0, 10.0, 31.0}) {
    for (const double lambda : {1e-6, 1e-3, 0.1, 1.0, 4.0, 30.0, 200.0}) {
      const double expected = reference_information(lambda, sigma);
      EXPECT_NEAR(fisher_information_e2(lambda, sigma) / expected, 1, 1e-7) << lambda << ' ' << sigma;  // relative
    }
  }
}

TEST(FisherInformation, FarOutAgreesWithAnotherFormInLongDouble) {
  struct Place {
    double lambda, sigma;
  };
  for (const Place& p : {Place{1000, 0.25},
                         {1000, 0.5},
                         {1000, 0.99},
                         {1000, 1},
                         {999, 3},
                         {500, 23},
                         {1e-3, 32},
                         {1, 40},
                         {200, 100},
                         {3000, 2}}) {
    ASSERT_GE(p.lambda + p.sigma * p.sigma, 1000);
    const double expected = reference_information(p.lambda, p.sigma);
    EXPECT_NEAR(fisher_information_e2(p.lambda, p.sigma) / expected, 1, 1e-6) << p.lambda << ' ' << p.sigma;
  }
}

TEST(FisherInformation, HasNoStepWhereItsFormsMeet) {
  for (const double sigma : {0.1, 0.4, 1.0, 5.0, 30.0}) {
    const double lambda = 1000 - sigma * sigma;
    const double below = fisher_information_e2(lambda * (1 - 1e-12), sigma);
    EXPECT_NEAR(fisher_information_e2(lambda * (1 + 1e-12), sigma) / below, 1, 1e-6) << sigma;  // as stated
  }
  for (const double lambda : {1e-6, 1.0, 100.0}) {  // counting begins at 0.05 e-
    EXPECT_NEAR(fisher_information_e2(lambda, 0.0499) / fisher_information_e2(lambda, 0.0501), 1, 1e-6) << lambda;
  }
}

TEST(FisherInformation, OfMuchLightIsTheReciprocalOfTheVariance) {
  for (const double sigma : {0.1, 1.0, 10.0, 100.0}) {
    EXPECT_NEAR(fisher_information_e2(1e6, sigma) * (1e6 + sigma * sigma), 1, 1e-6) << sigma;
  }
  for (const double lambda : {1e-6, 1.0, 1e4, 1e6}) {  // and of much read noise: to 1 / (2 sigma^2)
    EXPECT_NEAR(fisher_information_e2(lambda, 100) * (lambda + 1e4), 1, 6e-5) << lambda;
  }
}

TEST(FisherInformation, WithoutReadNoiseIsThatOfCounting) {
  for (const double lambda : {1e-6, 0.3, 7.0, 1e6}) {
    EXPECT_EQ(fisher_information_e2(lambda, 0), 1 / lambda);
    EXPECT_NEAR(fisher_information_e2(lambda, 0.06) * lambda, 1, 1e-5) << lambda;  // exp(-1 / (8 sigma^2)) at least
  }
}

TEST(FisherInformation, WithoutChargeIsThatOfAShiftedNormalLaw) {
  EXPECT_EQ(fisher_information_e2(0, 0), inf);
  EXPECT_EQ(fisher_information_e2(0, 0.01), inf);  // exp(10000)
  for (const double sigma : {0.5, 1.0, 3.0, 100.0}) {
    const double limit = std::expm1(1 / (sigma * sigma));
    EXPECT_DOUBLE_EQ(fisher_information_e2(0, sigma), limit);
    // Continuous at 0: 1e-9 e- change it by their share of exp(4 / sigma^2), which is 9e6 for 0.5 e-.
    EXPECT_NEAR(fisher_information_e2(1e-9, sigma) / limit, 1, sigma < 1 ? 1e-2 : 1e-6) << sigma;
  }
}

TEST(FisherInformation, LiesBetweenThatOfTheMeanAndThatOfCountingAndFallsWithNoiseAndCharge) {
  for (const double lambda : {1e-6, 1e-3, 0.1, 1.0, 10.0, 500.0, 1e4, 1e6}) {
    double before = inf;
    for (const double sigma : {0.1, 0.3, 0.7, 1.0, 3.0, 20.0, 100.0}) {
      const double information = fisher_information_e2(lambda, sigma);
      EXPECT_LE(information, (1 + 1e-6) / lambda);
      EXPECT_GE(information, (1 - 1e-6) / (lambda + sigma * sigma));
      EXPECT_LE(information, before * (1 + 1e-6)) << lambda << ' ' << sigma;
      EXPECT_LT(fisher_information_e2(lambda * 1.01, sigma), information * (1 + 1e-6)) << lambda << ' ' << sigma;
      before = information;
    }
  }
}

TEST(FisherInformation, GivesThePublishedEfficienciesOfTheMean) {
  // For sigma = 0.3, lambda = 4 the table has 1.00; it is 0.9949 by quadrature in long double too.
  const double lambdas[] = {0.1, 0.5, 1, 2, 4, 20, 200};
  struct Row {
    double sigma;
    std::array<double, 7> efficiency;
  };
  for (const Row& row : {Row{0.3, {0.65, 0.93, 0.97, 0.99, 0.99, 1.00, 1.00}},
                         {0.5, {0.61, 0.92, 0.98, 1.00, 1.00, 1.00, 1.00}},
                         {1.0, {0.71, 0.88, 0.94, 0.98, 1.00, 1.00, 1.00}},
                         {1.5, {0.82, 0.89, 0.93, 0.97, 0.99, 1.00, 1.00}},
                         {3.0, {0.95, 0.95, 0.96, 0.97, 0.98, 1.00, 1.00}}}) {
    for (std::size_t i = 0; i < row.efficiency.size(); ++i) {
      EXPECT_NEAR(efficiency(lambdas[i], row.sigma), row.efficiency[i], 0.0051)  // half of the last digit
          << row.sigma << ' ' << lambdas[i];
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
