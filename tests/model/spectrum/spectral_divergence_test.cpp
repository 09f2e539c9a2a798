#include "isp/model/spectrum/spectral_divergence.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {
namespace {

using Vector = std::array<double, 3>;
constexpr std::array<Vector, 3> unit{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

SpectralBasis<3> cones() {
  const auto sensitivity = cone_fundamentals(ConeSet::stockman_sharpe_2000);
  SpectralBasis<3> basis;
  for (int nm = 390; nm <= 730; nm += 5) {
    basis.f.push_back({sensitivity[0].at(nm), sensitivity[1].at(nm), sensitivity[2].at(nm)});
    basis.weight_nm.push_back(5);
  }
  return basis;
}

/// The same in the six digits that CVRL prints linear sensitivities with.
SpectralBasis<3> cones_in_six_digits() {
  SpectralBasis<3> basis = cones();
  for (Vector& f : basis.f) {
    for (double& value : f) {
      if (value == 0) continue;
      const double scale = std::pow(10, 5 - std::floor(std::log10(value)));
      value = std::round(value * scale) / scale;
    }
  }
  return basis;
}

/// The fit to the moments of 0.1 + exp(-((nm - centre) / width)^2 / 2).
MaxEntropyFit<3> fit_of(double centre_nm, double width_nm, const SpectralBasis<3>& basis = cones()) {
  Vector eta{};
  double whole = 0;
  for (std::size_t i = 0; i < basis.f.size(); ++i) {
    const double z = (390 + 5.0 * static_cast<double>(i) - centre_nm) / width_nm;
    const double p = 0.1 + std::exp(-z * z / 2);
    whole += p;
    for (std::size_t k = 0; k < 3; ++k) eta[k] += p * basis.f[i][k];
  }
  for (double& value : eta) value /= whole;
  return fit_max_entropy<3>(basis, eta, unit, 1e-3).value();
}

TEST(SpectralDivergence, OfFitsHasItsCheckValues) {
  const SpectralBasis<3> basis = cones_in_six_digits();
  const MaxEntropyFit<3> green = fit_of(540, 40, basis), orange = fit_of(600, 30, basis);
  // Of an independent program, nine decimals, which had the cones in six digits (with our eight the first is
  // 0.506136008). 3e-9: the sixth of a few may have been rounded otherwise.
  EXPECT_NEAR(kullback_leibler(green, orange), 0.506136217, 3e-9);
  EXPECT_NEAR(kullback_leibler(orange, green), 0.525428585, 3e-9);
  EXPECT_NEAR(jeffreys(green, orange), 1.031564802, 3e-9);
  EXPECT_EQ(jeffreys(green, orange), jeffreys(orange, green));
}

TEST(SpectralDivergence, OfFitsIsTheSumOverTheNodes) {
  const SpectralBasis<3> basis = cones();
  const MaxEntropyFit<3> first = fit_of(470, 15), second = fit_of(630, 60);
  double sum = 0;
  for (std::size_t i = 0; i < basis.f.size(); ++i) {
    double log_p = -first.psi, log_q = -second.psi;
    for (std::size_t k = 0; k < 3; ++k) {
      log_p += first.theta[k] * basis.f[i][k];
      log_q += second.theta[k] * basis.f[i][k];
    }
    sum += basis.weight_nm[i] * std::exp(log_p) * (log_p - log_q);
  }
  EXPECT_NEAR(kullback_leibler(first, second), sum, 1e-12 * sum);  // rounding of 69 terms
  EXPECT_NEAR(jeffreys(first, second), kullback_leibler(first, second) + kullback_leibler(second, first), 1e-12);
}

TEST(SpectralDivergence, OfAFitFromItselfIsNone) {
  const MaxEntropyFit<3> green = fit_of(540, 40);
  EXPECT_EQ(kullback_leibler(green, green), 0);
  EXPECT_EQ(jeffreys(green, green), 0);
  MaxEntropyFit<3> nearly = green;  // a rounding away
  nearly.psi = std::nextafter(nearly.psi, 0);
  EXPECT_GE(kullback_leibler(green, nearly), 0);
}

template <class Power>
Spectrum measured(const Power& power) {
  std::vector<double> nm, value;
  for (int i = 380; i <= 780; i += 2) {
    nm.push_back(i);
    value.push_back(power(static_cast<double>(i)));
  }
  return Spectrum::of(std::move(nm), std::move(value)).value();
}

Spectrum bell(double centre_nm, double scale = 1) {
  return measured([&](double nm) { return scale * std::exp(-(nm - centre_nm) * (nm - centre_nm) / (2 * 30 * 30)); });
}

TEST(SpectralDivergence, OfBellsIsHalfTheSquareOfTheirDistanceInWidths) {
  // D = d^2 / 2 for normal densities of one width. The trapezium rule is exact for them but for the ends, which lie at
  // 5 and 6 widths: 2e-5 of the area, with logarithms below 10.
  EXPECT_NEAR(kullback_leibler(bell(560), bell(590)).value(), 0.5, 1e-4);
  EXPECT_NEAR(jeffreys(bell(560), bell(590)).value(), 1, 1e-4);
}

TEST(SpectralDivergence, BrightnessDoesNotMatter) {
  const double expected = kullback_leibler(bell(560), bell(600)).value();
  EXPECT_NEAR(kullback_leibler(bell(560, 1e300), bell(600, 1e-290)).value(), expected, 1e-12);
}

TEST(SpectralDivergence, WhereTheSecondIsDarkTheFloorDecides) {
  // Even light at 380 to 580 nm and at 582 nm on: the trapezium rule gives the first 100.5 steps, the second 99.5.
  const Spectrum blue = measured([](double nm) { return nm <= 580 ? 2.0 : 0.0; });
  const Spectrum red = measured([](double nm) { return nm <= 580 ? 0.0 : 7.0; });
  const double blue_mass = 100.5, red_mass = 99.5;
  const double expected = std::log((1 / blue_mass) / (spectral_floor / red_mass));
  // The floor is 1e-12 of each mass, taken from where the logarithm is 27.6 and added where it is -27.6, twice for J.
  EXPECT_NEAR(kullback_leibler(blue, red).value(), expected, 1e-10);
  EXPECT_NEAR(jeffreys(blue, red).value(), 2 * -std::log(spectral_floor), 2e-10);
}

TEST(SpectralDivergence, NegativeNoiseCountsAsDark) {
  const Spectrum dark = measured([](double nm) { return nm <= 580 ? 1.0 : 0.0; });
  const Spectrum noisy = measured([](double nm) { return nm <= 580 ? 1.0 : -1e-3; });
  EXPECT_EQ(kullback_leibler(dark, noisy).value(), 0);
}

TEST(SpectralDivergence, RefusesWhatCannotBeCompared) {
  const Spectrum coarse = Spectrum::of({380, 580, 780}, {1, 1, 1}).value();
  const auto other_nodes = kullback_leibler(bell(560), coarse);
  ASSERT_FALSE(other_nodes);
  EXPECT_EQ(other_nodes.error().code, ErrorCode::malformed);
  const Spectrum dark = measured([](double) { return 0.0; }), negative = measured([](double) { return -1.0; });
  for (const Spectrum& without : {dark, negative}) {
    const auto first = jeffreys(without, bell(560)), second = jeffreys(bell(560), without);
    ASSERT_FALSE(first || second);
    EXPECT_EQ(first.error().code, ErrorCode::insufficient);
    EXPECT_NE(first.error().message.find("first"), std::string::npos);
    EXPECT_NE(second.error().message.find("second"), std::string::npos);
  }
}

}  // namespace
}  // namespace lowlux::isp
