#include "isp/reproduce/clouds/observed_clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "isp/reproduce/clouds/chromaticity_clouds.h"

namespace lowlux::isp {
namespace {

PhotonMeans chip_photons(std::string_view chip) {
  return *mean_photons(reflected(*light_named("E"), *spectrum_named(SpectrumSet::munsell_ten, chip)), 6e-15, 0.2);
}

// Two ways to the same sums. Relative: rounding.
TEST(PredictedCloudBy, IsPredictedCloudForTheObserverOfCie1931) {
  const PhotonMeans means = chip_photons("5B_5_6");
  const auto by_observer = predicted_cloud_by(standard_observer(), means), by_cie = predicted_cloud(means);
  ASSERT_TRUE(by_observer && by_cie);
  EXPECT_NEAR(by_observer->mean.x, by_cie->mean.x, 1e-14);
  EXPECT_NEAR(by_observer->mean.y, by_cie->mean.y, 1e-14);
  EXPECT_NEAR(by_observer->covariance.xx, by_cie->covariance.xx, 1e-12 * by_cie->covariance.xx);
  EXPECT_NEAR(by_observer->covariance.xy, by_cie->covariance.xy, 1e-12 * by_cie->covariance.xx);
  EXPECT_NEAR(by_observer->covariance.yy, by_cie->covariance.yy, 1e-12 * by_cie->covariance.yy);
}

// Cones that are linear combinations of the CIE 1931 functions give these functions again: here XYZ to the cones of
// Hunt, Pointer and Estevez, and back by least squares.
TEST(NearestSums, InvertALinearCombination) {
  const auto& cie = cie_1931_observer();
  const auto cone = [&](double x, double y, double z) {
    return cie[0].mapped([&](double nm, double value) { return x * value + y * cie[1].at(nm) + z * cie[2].at(nm); });
  };
  const std::array<Spectrum, 3> cones{cone(0.38971, 0.68898, -0.07868), cone(-0.22981, 1.18340, 0.04641),
                                      cone(0, 0, 1)};
  const std::array<Spectrum, 3> back = nearest_sums(cones, cie);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(back[i].size(), 81u);
    // Per unit of the functions, up to 1.8: the condition of the normal equations times rounding.
    for (const double nm : {380, 450, 555, 600, 780})
      EXPECT_NEAR(back[i].at(nm), cie[i].at(nm), 1e-11) << i << " " << nm;
  }
}

struct ChipByCones {
  const char* chip;
  ConeSet cones;
  double x, y, size, inclination_deg;
};

// Figures of an independent program (plain Python from the same tables) in the digits that it prints.
TEST(ConeObserver, GivesTheCloudsOfAnIndependentProgram) {
  using enum ConeSet;
  for (const ChipByCones& want : {ChipByCones{"10GY_6_10", stockman_sharpe_2000, 0.3184, 0.4938, 0.0072, 84.8104},
                                  ChipByCones{"10GY_6_10", smith_pokorny_1975, 0.3169, 0.4919, 0.0072, 84.9994},
                                  ChipByCones{"7p5YR_5_8", stockman_sharpe_2000, 0.4818, 0.4085, 0.0074, 51.9205},
                                  ChipByCones{"10RP_4_10", smith_pokorny_1975, 0.4758, 0.2934, 0.0111, 37.8510},
                                  ChipByCones{"5B_5_6", smith_pokorny_1975, 0.2316, 0.2815, 0.0076, 74.2413}}) {
    const auto cloud = predicted_cloud_by(cone_observer(want.cones), chip_photons(want.chip));
    ASSERT_TRUE(cloud);
    const XyEllipse ellipse = principal_ellipse(*cloud, 1);
    EXPECT_NEAR(cloud->mean.x, want.x, 0.00005 + 1e-9) << want.chip;
    EXPECT_NEAR(cloud->mean.y, want.y, 0.00005 + 1e-9) << want.chip;
    EXPECT_NEAR(size_of(ellipse), want.size, 0.00005 + 1e-9) << want.chip;
    EXPECT_NEAR(ellipse.inclination_deg, want.inclination_deg, 0.00005 + 1e-9) << want.chip;
  }
}

TEST(ConeObserver, SeesNoColourWithoutPhotons) {
  PhotonMeans none = chip_photons("5B_5_6");
  std::ranges::fill(none.photons, 0);
  EXPECT_FALSE(predicted_cloud_by(cone_observer(ConeSet::stockman_sharpe_2000), none));
}

TEST(SampleColours, DrawsTheSamePhotonsForEveryObserver) {
  const Spectrum light = *light_named("E");
  std::vector<Colour> first{{"E", light, {}}}, second{{"E", light, {}}};
  ASSERT_TRUE(sample_colours(first, standard_observer(), {7, 0x200, 20}));
  // Twice all functions is the same chromaticity for the same counts.
  Observer twice = standard_observer();
  for (Spectrum& f : twice.xyz) f = f.mapped([](double, double value) { return 2 * value; });
  ASSERT_TRUE(sample_colours(second, twice, {7, 0x200, 20}));
  ASSERT_EQ(first.front().clouds.size(), second.front().clouds.size());
  EXPECT_EQ(first.front().clouds.back().samples, second.front().clouds.back().samples);
}

TEST(MetamericHalves, HaveOneColourUnderD65AndTwoSpectra) {
  const auto halves = metameric_halves();
  ASSERT_TRUE(halves) << halves.error().message;
  ASSERT_EQ(halves->size(), 48u);
  for (std::size_t i = 0; i < halves->size(); i += 2) {
    const Spectrum &first = (*halves)[i].light, &second = (*halves)[i + 1].light;
    const Xyz a = xyz_of(first), b = xyz_cd_m2(second);
    // Relative to X + Y + Z: the lift's smoothing weight of 1e-6 leaves less than 1e-5 in each of x and y.
    const double sum = a.x + a.y + a.z;
    EXPECT_NEAR(b.x, a.x, 1e-5 * sum) << (*halves)[i].name;
    EXPECT_NEAR(b.y, a.y, 1e-5 * sum) << (*halves)[i].name;
    EXPECT_NEAR(b.z, a.z, 1e-5 * sum) << (*halves)[i].name;
    EXPECT_GT(spectral_distance(*normalised(first), *normalised(second)), 1e-3) << (*halves)[i].name;
  }
}

// The smoothest light has the larger entropy of the two, by its definition.
TEST(MetamericHalves, TheSecondHasTheLargerEntropy) {
  const auto entropy = [](const Spectrum& light) {
    const Spectrum p = *normalised(light);
    return -integrate(p.mapped([](double, double value) { return value > 0 ? value * std::log(value) : 0; }));
  };
  const auto halves = metameric_halves();
  ASSERT_TRUE(halves);
  for (std::size_t i = 0; i < halves->size(); i += 2) {
    EXPECT_GT(entropy((*halves)[i + 1].light), entropy((*halves)[i].light)) << (*halves)[i].name;
  }
}

}  // namespace
}  // namespace lowlux::isp
