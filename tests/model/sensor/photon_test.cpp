#include "isp/model/sensor/photon.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

Spectrum spectrum(std::vector<double> nm, std::vector<double> values) {
  return *Spectrum::of(std::move(nm), std::move(values));
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(Photons, OneWattOfGreenLightIsThePublishedNumberPerSecond) {
  // CIE: 1 W at 555 nm is 2.794e18 photons per second (555e-9 / (h c), h c = 1.98644586e-25 J m, CODATA 2018).
  EXPECT_NEAR(1 / photon_energy_j(555), 2.79393e18, 1e13);  // half a unit of the last digit
  const auto photons = photon_radiance(spectrum({500, 555, 600}, {0, 1, 0}));
  ASSERT_TRUE(photons);
  EXPECT_DOUBLE_EQ(photons->values()[1], 1 / photon_energy_j(555));
  EXPECT_EQ(photons->values()[0], 0);
}

TEST(Photons, UnequalStepsWeighNodesLikeTheTrapeziumRule) {
  const Spectrum s = spectrum({400, 410, 440, 445}, {1, 2, 5, 3});
  EXPECT_EQ(bin_widths_nm(s), (std::vector<double>{5, 20, 17.5, 2.5}));
  const auto widths = bin_widths_nm(s);
  double by_widths = 0;
  for (std::size_t i = 0; i < widths.size(); ++i) by_widths += widths[i] * s.values()[i];
  EXPECT_DOUBLE_EQ(by_widths, integrate(s));
}

TEST(Photons, MeansCarryTheWholeEnergyAtAnyScaleOfTheSpectrum) {
  for (const double scale : {1e-300, 1e-3, 1.0, 1e300}) {
    const auto means = mean_photons(spectrum({400, 410, 440, 700}, {scale, 2 * scale, 5 * scale, 0}), 6e-15, 0.2);
    ASSERT_TRUE(means) << scale;
    double energy_j = 0;
    for (std::size_t i = 0; i < means->photons.size(); ++i) {
      energy_j += means->photons[i] * photon_energy_j(means->wavelengths_nm[i]);
    }
    EXPECT_NEAR(energy_j, 1.2e-15, 1.2e-15 * 1e-14);  // a few roundings
  }
}

TEST(Photons, OneBinAloneGetsAllPhotons) {
  const auto means = mean_photons(spectrum({400, 500, 700}, {0, 3, 0}), 1e-15, 1);
  ASSERT_TRUE(means);
  EXPECT_NEAR(sum(means->photons), 1e-15 / photon_energy_j(500), 1e-9);  // of 2517 photons
  const auto seen = estimated_spectrum(*means, means->photons);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(spectral_distance(*seen, *normalised(spectrum({400, 500, 700}, {0, 3, 0}))), 0, 1e-15);
  EXPECT_NEAR(*expected_squared_distance(*means), 0, 1e-18);  // one bin has all of it, however few photons
}

TEST(Photons, NoPowerOrNoTimeIsNoPhotonAndNoSpectrum) {
  const Spectrum flat = spectrum({400, 500}, {1, 1});
  for (const auto& [power_w, exposure_s] : {std::pair{0.0, 1.0}, std::pair{1.0, 0.0}}) {
    const auto means = mean_photons(flat, power_w, exposure_s);
    ASSERT_TRUE(means);
    EXPECT_EQ(sum(means->photons), 0);
    EXPECT_FALSE(estimated_spectrum(*means, means->photons));
    EXPECT_FALSE(expected_squared_distance(*means));
  }
}

TEST(Photons, WhatIsNoLightOrNoTimeIsRefused) {
  const Spectrum flat = spectrum({400, 500}, {1, 1});
  for (const double bad : {nan, inf, -1.0, -1e-300}) {
    EXPECT_FALSE(mean_photons(flat, bad, 1)) << bad;
    EXPECT_FALSE(mean_photons(flat, 1, bad)) << bad;
  }
  EXPECT_FALSE(mean_photons(flat, 1e200, 1e200));  // beyond double
  EXPECT_FALSE(mean_photons(spectrum({400, 500}, {1, -1e-9}), 1, 1));
  EXPECT_FALSE(mean_photons(spectrum({400, 500}, {0, 0}), 1, 1));
  EXPECT_FALSE(mean_photons(spectrum({-400, 500}, {1, 1}), 1, 1));
  EXPECT_FALSE(photon_radiance(spectrum({400, 500}, {1, -1})));
  EXPECT_FALSE(photon_radiance(spectrum({0, 500}, {1, 1})));
  EXPECT_FALSE(photon_radiance(spectrum({400, 500}, {1, 1e300})));  // 1e318 photons
  EXPECT_NE(photon_radiance(spectrum({400, 500}, {1, -1})).error().message.find("500"), std::string::npos);
}

TEST(EstimatedSpectrum, IntegratesToOneOnUnequalSteps) {
  const auto means = mean_photons(spectrum({400, 410, 440, 445, 700}, {1, 2, 5, 3, 1}), 1e-15, 1);
  const std::vector<double> counts{0, 3, 17, 1, 2};
  const auto seen = estimated_spectrum(*means, counts);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(integrate(*seen), 1, 1e-15);
  // By hand: energies 3/410, 17/440, 1/445, 2/700 in units of h c; the second bin is 20 nm wide.
  EXPECT_NEAR(seen->values()[1], 3 / 410.0 / 20 / (3 / 410.0 + 17 / 440.0 + 1 / 445.0 + 2 / 700.0), 1e-16);
}

TEST(EstimatedSpectrum, ExpectedCountsGiveTheTrueSpectrum) {
  const Spectrum power = spectrum({400, 410, 440, 445, 700}, {1, 2, 5, 3, 1});
  const auto means = mean_photons(power, 1e-9, 0.2);
  const auto seen = estimated_spectrum(*means, means->photons);
  EXPECT_NEAR(spectral_distance(*seen, *normalised(power)), 0, 1e-16);
}

TEST(SpectralDistance, OfTwoBinsIsTheClosedFormBinomial) {
  // Two bins at nearly one wavelength share n photons: p is binomial to first order, Var p = p (1 - p) / n, and both
  // bins differ by the same amount: D^2 = 2 (dp)^2 / width.
  const auto means = mean_photons(spectrum({500, 500.002}, {3, 1}), 1e-15, 1);
  const double n = sum(means->photons);
  EXPECT_NEAR(*expected_squared_distance(*means), 2 * (0.75 * 0.25 / n) / 0.001, 1e-5 * 2 * 0.1875 / n / 0.001);
}

TEST(SpectralDistance, FallsWithTheRootOfThePhotons) {
  const Spectrum power = spectrum({400, 410, 440, 445, 700}, {1, 2, 5, 3, 1});
  const double few = *expected_squared_distance(*mean_photons(power, 1e-15, 1));
  const double many = *expected_squared_distance(*mean_photons(power, 1e-11, 1));
  EXPECT_NEAR(few / many, 1e4, 1e-8);
}

}  // namespace
}  // namespace lowlux::isp
