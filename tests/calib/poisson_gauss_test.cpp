#include "calib/dark/dark_fit.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace lowlux::calib {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(PoissonGauss, WithoutPoissonIsNormal) {
  const PoissonGauss law{0, 4};
  EXPECT_NEAR(truncation_bias_e(law, -3, 3), 0, 1e-12);
  // Upper half of a normal law: mean sigma sqrt(2 / pi).
  EXPECT_NEAR(truncation_bias_e(law, 0, infinity), 2 * std::sqrt(2 / std::numbers::pi), 1e-12);
  EXPECT_NEAR(truncation_bias_e(law, -infinity, infinity), 0, 1e-12);
  EXPECT_EQ(truncation_bias_e(law, 300, 301), 0);  // nothing there
}

TEST(PoissonGauss, ThreeSigmaMeanIsThatOfThePrototype) {
  // Specification of the denoiser, section 3: to the two digits it gives, from 2e6 draws.
  struct {
    double mean_e, read_noise_e, clipped_off_e;
  } const cases[] = {{2, 1.5, -0.02}, {200, 4, -0.04}};
  for (const auto& c : cases) {
    const PoissonGauss law{c.mean_e, c.read_noise_e * c.read_noise_e};
    const double cut = 3 * std::sqrt(c.mean_e + law.normal_variance_e2);
    EXPECT_NEAR(truncation_bias_e(law, c.mean_e - cut, c.mean_e + cut), c.clipped_off_e, 0.006);
  }
}

TEST(PoissonGauss, TruncationBiasIsThatOfDraws) {
  const PoissonGauss law{0.3, 0.25};
  std::mt19937_64 engine(5);
  std::poisson_distribution<int> poisson(law.poisson_mean_e);
  std::normal_distribution<double> normal(0, 0.5);
  double n = 0, sum = 0, squares = 0;
  for (int i = 0; i < 400000; ++i) {
    const double v = poisson(engine) + normal(engine);
    if (v < -1 || v > 1.5) continue;
    ++n;
    sum += v;
    squares += v * v;
  }
  const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / n);
  EXPECT_NEAR(truncation_bias_e(law, -1, 1.5), mean - law.poisson_mean_e, 5 * error);
}

TEST(PoissonGauss, LargeMeansAreHandled) {
  const PoissonGauss law{1e6, 1};
  EXPECT_NEAR(truncation_bias_e(law, -infinity, infinity), 0, 1e-5);
}

}  // namespace
}  // namespace lowlux::calib
