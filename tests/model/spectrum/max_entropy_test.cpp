#include "isp/model/spectrum/max_entropy.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "tests/support/numbers.h"

namespace lowlux::isp::max_entropy_test {
namespace {

using test::inf;
using test::nan;

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;
constexpr Matrix unit{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

/// Cones with a share xi of the rods: f_i = cone_i + xi w_i V', w = (3, 3, 5); 390 to 730 nm by 5.
SpectralBasis<3> basis_of(double xi) {
  const auto cones = cone_fundamentals(ConeSet::stockman_sharpe_2000);
  const Spectrum rods = column_of(cones_stockman_sharpe_2deg_1nm_table(), 4);
  SpectralBasis<3> basis;
  for (int nm = 390; nm <= 730; nm += 5) {
    basis.f.push_back({cones[0].at(nm) + xi * 3 * rods.at(nm), cones[1].at(nm) + xi * 3 * rods.at(nm),
                       cones[2].at(nm) + xi * 5 * rods.at(nm)});
    basis.weight_nm.push_back(5);
  }
  return basis;
}

/// Moments of 0.1 + exp(-((nm - 540) / 40)^2 / 2), integral 1.
Vector moments_of_a_green(const SpectralBasis<3>& basis) {
  Vector eta{};
  double whole = 0;
  for (std::size_t i = 0; i < basis.f.size(); ++i) {
    const double nm = 390 + 5.0 * static_cast<double>(i);
    const double p = basis.weight_nm[i] * (0.1 + std::exp(-0.5 * (nm - 540) * (nm - 540) / 1600));
    whole += p;
    for (int k = 0; k < 3; ++k) eta[k] += p * basis.f[i][k];
  }
  for (double& value : eta) value /= whole;
  return eta;
}

struct Row {
  double m;
  Vector eta, theta;
  double psi, entropy;
};

double xi_of(double m) { return (std::exp(1 - m) - 1) / (std::exp(1.0) - 1); }
double gamma_of(double m) { return m == 1 ? 1e-8 : 2 * (1 - m); }

// Computed for the thesis' mesopic model with an independent program; six decimals.
const Row published[] = {
    {1, {0.602328, 0.574760, 0.101380}, {0.102491, 2.064765, 0.199139}, 6.784676, 5.516009},
    {0.784125, {0.807189, 0.779621, 0.442815}, {0.587723, 0.630907, 0.079080}, 6.533327, 5.693882},
    {0.480425, {1.181601, 1.154033, 1.066835}, {0.381727, 0.360595, 0.039261}, 6.476378, 5.711376},
    {0, {2.063263, 2.035696, 2.536272}, {0.224583, 0.199126, -0.005967}, 6.460987, 5.697510},
};

TEST(MaxEntropy, GivesThePublishedFitsOfAGreenFromPhotopicToScotopic) {
  for (const Row& row : published) {
    SCOPED_TRACE(row.m);
    const SpectralBasis<3> basis = basis_of(xi_of(row.m));
    const Vector eta = moments_of_a_green(basis);
    const auto fit = fit_max_entropy<3>(basis, eta, unit, gamma_of(row.m));
    ASSERT_TRUE(fit);
    const double digits = 1e-6;  // of the table, m in six decimals included
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(eta[k], row.eta[k], 2 * digits);
      EXPECT_NEAR(fit->theta[k], row.theta[k], 2 * digits);
    }
    EXPECT_NEAR(fit->psi, row.psi, 2 * digits);
    EXPECT_NEAR(fit->entropy, row.entropy, 2 * digits);
    EXPECT_GE(fit->iterations, 3);
    EXPECT_LE(fit->iterations, 6);
  }
}

TEST(MaxEntropy, MeetsTheConditionOfItsMinimum) {
  const Matrix inverse_a{{{2, 0.3, 0}, {0.3, 1, -0.2}, {0, -0.2, 0.5}}};
  for (const double gamma : {1e-6, 1e-2, 2.0}) {
    const SpectralBasis<3> basis = basis_of(0);
    const Vector eta = moments_of_a_green(basis);
    const auto fit = fit_max_entropy<3>(basis, eta, inverse_a, gamma);
    ASSERT_TRUE(fit);
    double whole = 0, entropy = 0;
    Vector moments{};
    for (std::size_t i = 0; i < basis.f.size(); ++i) {
      double log_p = -fit->psi;
      for (int k = 0; k < 3; ++k) log_p += basis.f[i][k] * fit->theta[k];
      const double p = basis.weight_nm[i] * std::exp(log_p);
      whole += p;
      entropy -= p * log_p;
      for (int k = 0; k < 3; ++k) moments[k] += p * basis.f[i][k];
    }
    // Rounding of doubles: 4e-16, 4e-15 and 2e-16 were measured.
    EXPECT_NEAR(whole, 1, 4e-15);
    EXPECT_NEAR(fit->entropy, entropy, 3e-14);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(fit->moments[k], moments[k], 2e-15);
      // moments - eta + (gamma / 2) A^-1 theta = 0: the method ends below 1e-10, however far its last step goes below.
      double gradient = fit->moments[k] - eta[k];
      for (int j = 0; j < 3; ++j) gradient += gamma / 2 * inverse_a[k][j] * fit->theta[j];
      EXPECT_NEAR(gradient, 0, 1e-10);
    }
  }
}

TEST(MaxEntropy, ComesCloserToItsMomentsTheSmallerGammaIs) {
  const SpectralBasis<3> basis = basis_of(0);
  const Vector eta = moments_of_a_green(basis);
  double before = inf;
  for (const double gamma : {1.0, 1e-2, 1e-4, 1e-6}) {
    const auto fit = fit_max_entropy<3>(basis, eta, unit, gamma);
    ASSERT_TRUE(fit);
    double miss = 0;
    for (int k = 0; k < 3; ++k) miss = std::fmax(miss, std::fabs(fit->moments[k] - eta[k]));
    EXPECT_LT(miss, before / 10);
    before = miss;
  }
}

double largest(const Vector& v) { return std::fmax(std::fabs(v[0]), std::fmax(std::fabs(v[1]), std::fabs(v[2]))); }

// No light gives these moments: the nearest are looked for, and the multipliers grow without limit as gamma falls. The
// independent program needs 7 and 17 steps, and more than 30 for the last.
TEST(MaxEntropy, OfImpossibleMomentsTakesTheStepsPublished) {
  const SpectralBasis<3> basis = basis_of(0);
  const Vector impossible{0.1, 0.9, 0.1};
  const auto loose = fit_max_entropy<3>(basis, impossible, unit, 1e-2);
  ASSERT_TRUE(loose);
  EXPECT_LE(loose->iterations, 7);
  EXPECT_NEAR(largest(loose->theta), 68, 0.5) << "two digits are published";
  const auto tight = fit_max_entropy<3>(basis, impossible, unit, 1e-4);
  ASSERT_TRUE(tight);
  EXPECT_LE(tight->iterations, 17);
  EXPECT_NEAR(largest(tight->theta), 6.7e3, 50) << "two digits are published";
  const auto tightest = fit_max_entropy<3>(basis, impossible, unit, 1e-8);
  if (tightest) {
    EXPECT_GT(tightest->iterations, 30);
  }
  // Farther still from any light, and with rods that make the three functions nearly parallel.
  EXPECT_FALSE(fit_max_entropy<3>(basis_of(1), impossible, unit, 1e-8));
}

TEST(MaxEntropy, StartsFromANeighbour) {
  const SpectralBasis<3> basis = basis_of(0);
  const Vector eta = moments_of_a_green(basis);
  const auto cold = fit_max_entropy<3>(basis, eta, unit, 1e-6);
  ASSERT_TRUE(cold);
  const auto warm = fit_max_entropy<3>(basis, eta, unit, 1e-6, cold->theta);
  ASSERT_TRUE(warm);
  EXPECT_EQ(warm->iterations, 0);
  const auto near = fit_max_entropy<3>(basis, {eta[0] + 1e-4, eta[1], eta[2]}, unit, 1e-6, cold->theta);
  ASSERT_TRUE(near);
  EXPECT_LT(near->iterations, cold->iterations);
}

// Three bins, each its own moment: p is eta itself, theta the log odds against the third.
TEST(MaxEntropy, OfIndicatorsIsTheirLogOdds) {
  SpectralBasis<2> basis;
  basis.f = {{1, 0}, {0, 1}, {0, 0}};
  basis.weight_nm = {1, 1, 1};
  const std::array<std::array<double, 2>, 2> unit2{{{1, 0}, {0, 1}}};
  for (const auto& [p, q] : {std::pair{0.2, 0.3}, {0.98, 0.01}, {1e-3, 1e-3}, {1 / 3.0, 1 / 3.0}}) {
    const auto fit = fit_max_entropy<2>(basis, {p, q}, unit2, 1e-12);
    ASSERT_TRUE(fit);
    const double rest = 1 - p - q;
    // 1e-10 of the moments, divided by the smallest share: the slope of the log odds.
    const double tolerance = 1e-10 / std::fmin(rest, std::fmin(p, q)) * 4;
    EXPECT_NEAR(fit->theta[0], std::log(p / rest), tolerance);
    EXPECT_NEAR(fit->theta[1], std::log(q / rest), tolerance);
    EXPECT_NEAR(fit->entropy, -p * std::log(p) - q * std::log(q) - rest * std::log(rest), 4e-10)
        << "5e-11 was measured: 1e-10 of the moments, times their log odds";
  }
}

TEST(MaxEntropy, RefusesWhatIsNotANumberAndAGammaTooSmall) {
  const SpectralBasis<3> basis = basis_of(0);
  const Vector eta = moments_of_a_green(basis);
  for (const double bad : {nan, inf, -inf}) {
    EXPECT_FALSE(fit_max_entropy<3>(basis, {eta[0], bad, eta[2]}, unit, 1e-4));
    EXPECT_FALSE(fit_max_entropy<3>(basis, eta, {{{1, 0, 0}, {0, bad, 0}, {0, 0, 1}}}, 1e-4));
    EXPECT_FALSE(fit_max_entropy<3>(basis, eta, unit, 1e-4, {0, 0, bad}));
    EXPECT_FALSE(fit_max_entropy<3>(basis, eta, unit, bad));
  }
  EXPECT_FALSE(fit_max_entropy<3>(basis, eta, unit, 0.99e-12));
  EXPECT_FALSE(fit_max_entropy<3>(basis, eta, unit, -1));
  EXPECT_TRUE(fit_max_entropy<3>(basis, eta, unit, 1e-12));
  SpectralBasis<3> broken = basis;
  broken.f[7][1] = nan;
  EXPECT_FALSE(fit_max_entropy<3>(broken, eta, unit, 1e-4));
}

}  // namespace
}  // namespace lowlux::isp::max_entropy_test
