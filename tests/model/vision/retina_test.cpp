#include "isp/model/vision/retina.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

double log_uniform(std::mt19937& random, double from, double to) {
  return std::exp(std::uniform_real_distribution<double>(std::log(from), std::log(to))(random));
}

// The formula with its constants multiplied out, as watson-yellott-2012 print it in their Eq. 27, to six digits.
TEST(AdaptedPupil, IsTheUnifiedFormulaAtAnyLightFieldAndAge) {
  constexpr unsigned seed = 41;
  RecordProperty("seed", seed);
  std::mt19937 random(seed);
  for (int i = 0; i < 2000; ++i) {
    const double light = log_uniform(random, 1e-7, 1e9), area = log_uniform(random, 1, 40000);
    const double age = std::uniform_real_distribution<double>(20, 83)(random);
    const double f = std::pow(light * area, 0.41);
    const double expected = (18.5172 + 0.122165 * f - 0.105569 * age + 0.000138645 * f * age) / (2 + 0.0630635 * f);
    ASSERT_NEAR(adapted_pupil_mm(light, {area, age, 2}), expected, 2e-4) << light << " " << area << " " << age;
  }
}

TEST(AdaptedPupil, FallsFromDarknessToSunlight) {
  const double dark = adapted_pupil_mm(0), bright = adapted_pupil_mm(1e30);
  EXPECT_NEAR(dark, 7.75, 1e-12) << "mm, reference age";
  EXPECT_NEAR(bright, 2, 1e-3) << "mm, the smallest of the formula";
  EXPECT_NEAR(adapted_pupil_mm(846.0 / 100, {100, 28.58, 2}), 7.75 - 5.75 / 3, 1e-12) << "846 cd deg2/m2: F = 1";
  double last = dark;
  for (const double light : test::ratios(1e-7, 1e9, 1.5)) {
    const double here = adapted_pupil_mm(light);
    ASSERT_LE(here, last) << light;
    last = here;
  }
  EXPECT_NEAR(adapted_pupil_mm(100, {2827.4, 28.58, 1}), adapted_pupil_mm(10, {2827.4, 28.58, 2}), 1e-12);
  EXPECT_LT(adapted_pupil_mm(0.01, {2827.4, 70, 2}), adapted_pupil_mm(0.01)) << "pupils of the old stay smaller";
  for (const double none : {-1.0, nan, -inf}) EXPECT_EQ(adapted_pupil_mm(none), dark) << none;
  EXPECT_TRUE(std::isfinite(adapted_pupil_mm(inf)));
}

// wyszecki-stiles: 4.46e5 photons s-1 deg-2 for a scotopic troland at 507 nm, with 1745 lm/W, and 1.25e6 for a photopic
// one at 555 nm.
TEST(PhotonsPerTroland, AreThoseOfTheTextbook) {
  EXPECT_NEAR(photons_per_scotopic_td(507) * scotopic_efficacy_lm_w / 1745, 4.46e5, 0.005e5) << "three digits";
  EXPECT_NEAR(photons_per_photopic_td(555), 1.25e6, 0.005e6);
  const double sr = std::pow(std::numbers::pi / 180, 2);
  EXPECT_NEAR(photons_per_photopic_td(555) / (1e-6 * sr * 555e-9 / (683 * planck_j_s * light_speed_m_per_s)), 1, 1e-4)
      << "V(555 nm) = 1 in four digits";
  EXPECT_EQ(photons_per_photopic_td(300), 0);
  EXPECT_EQ(photons_per_scotopic_td(1000), 0);
}

// makous-2004, Table 53.1: a scotopic troland is 2.74e5 photons s-1 deg-2 on the retina, 3.23 in a um2. The media of
// CIE 203 transmit 0.71 at 507 nm where those of the table transmit 0.60: a fifth.
TEST(PhotonsPerTroland, ReachTheRetinaAsPublishedWithinAFifth) {
  const double on_retina = photons_per_scotopic_td(507) * ocular_transmittance(507);
  EXPECT_NEAR(on_retina, 2.74e5, 0.2 * 2.74e5);
  EXPECT_NEAR(on_retina / retina_um2_per_deg2, 3.23, 0.2 * 3.23);
}

TEST(OcularTransmittance, FallsWithAgeAndTowardsTheBlue) {
  for (const double nm : test::steps(400, 700, 10)) {
    ASSERT_LT(ocular_transmittance(nm, 70), ocular_transmittance(nm, 20)) << nm;
    ASSERT_LT(ocular_transmittance(nm), ocular_transmittance(nm + 10)) << nm;
    ASSERT_GT(ocular_transmittance(nm), 0);
    ASSERT_LT(ocular_transmittance(nm), 0.88) << "10^-0.06 is the limit of the formula";
  }
}

// From 4.31 (makous-2004) to 8.6 (kraft-1993) isomerisations per rod and second for a scotopic troland; of cones about
// 30 per photopic troland, by order of magnitude: within a factor of two.
TEST(Isomerisations, PerTrolandAreOfThePublishedSize) {
  EXPECT_GT(rod_isomerisations_per_td_s(), 4.31);
  EXPECT_LT(rod_isomerisations_per_td_s(), 8.6);
  EXPECT_GT(cone_isomerisations_per_td_s(), 15);
  EXPECT_LT(cone_isomerisations_per_td_s(), 60);
  RecordProperty("rod", std::to_string(rod_isomerisations_per_td_s()));
  RecordProperty("cone", std::to_string(cone_isomerisations_per_td_s()));
}

// One line of light: alpha of Eq. 2.5 times the photons in the aperture.
TEST(Isomerisations, OfOneLineAreTheClosedForm) {
  for (const Receptor receptor : all_receptors) {
    const ReceptorFigures& figures = figures_of(receptor);
    double peak = 0;
    for (const double nm : test::steps(400, 700, 1)) {
      const Spectrum line = *Spectrum::of({nm - 1, nm, nm + 1}, {0, 2.5e-6, 0});  // integral 2.5e-6 W m-2 sr-1
      const double photons = 2.5e-6 / photon_energy_j(nm) * std::pow(std::numbers::pi / 180, 2) * 20e-6;
      const double expected =
          photons * figures.aperture_um2 / retina_um2_per_deg2 * isomerisations_per_corneal_photon(receptor, nm);
      ASSERT_NEAR(*isomerisations_per_s(receptor, line, 20), expected, 1e-12 * expected) << nm;
      peak = std::max(peak, isomerisations_per_corneal_photon(receptor, nm));
    }
    EXPECT_NEAR(peak, *isomerisations_per_photon(figures.path), 1e-12) << "scaled at the peak";
  }
}

// V' is the rods' sensitivity: any spectrum isomerises them by its scotopic luminance. The table is linear between
// nodes of 1 nm, on which these spectra lie.
TEST(Isomerisations, OfRodsFollowFromScotopicLuminanceAlone) {
  constexpr unsigned seed = 7;
  RecordProperty("seed", seed);
  std::mt19937 random(seed);
  std::vector<double> nm = test::steps(380, 780, 1), power(nm.size());
  for (int i = 0; i < 300; ++i) {
    for (double& value : power) value = log_uniform(random, 1e-12, 1e3);
    const Spectrum light = *Spectrum::of(nm, power);
    const double pupil = log_uniform(random, 3, 50);
    const double expected = receptor_rates(luminance_of(light), pupil).rods;
    ASSERT_NEAR(*isomerisations_per_s(Receptor::rod, light, pupil), expected, 1e-12 * expected);
  }
}

TEST(Isomerisations, OfConesAreTheMeanOfLAndMUnderEqualEnergyLight) {
  const Spectrum equal = *Spectrum::of(test::steps(390, 780, 1), std::vector<double>(391, 1e-3));
  const double l = *isomerisations_per_s(Receptor::l_cone, equal, 10);
  const double m = *isomerisations_per_s(Receptor::m_cone, equal, 10);
  const double mean = (2 * l + m) / 3;
  EXPECT_NEAR(receptor_rates(luminance_of(equal), 10).cones, mean, 2e-3 * mean) << "360 to 390 nm is missing here";
  EXPECT_GT(l, m);
  // Other lights: the mean of L and M differs from V(lambda) by less than a quarter.
  for (const std::string_view name : light_names()) {
    const Spectrum light = *light_named(name);
    const double own =
        (2 * *isomerisations_per_s(Receptor::l_cone, light, 1) + *isomerisations_per_s(Receptor::m_cone, light, 1)) / 3;
    const double by_luminance = receptor_rates(luminance_of(light), 1).cones;
    EXPECT_NEAR(own, by_luminance, 0.25 * by_luminance) << name;
  }
}

TEST(Isomerisations, AreLinearInLightAndPupilOverAllOfVision) {
  for (const double light : test::ratios(1e-9, 1e9, 3.7)) {
    const ReceptorRates one = receptor_rates({light, 2 * light}, 1), many = receptor_rates({light, 2 * light}, 38.5);
    ASSERT_NEAR(many.rods, 38.5 * one.rods, 1e-12 * many.rods);
    ASSERT_NEAR(many.cones, 38.5 * one.cones, 1e-12 * many.cones);
    ASSERT_NEAR(one.rods, 2 * light * rod_isomerisations_per_td_s(), 1e-12 * one.rods);
  }
  for (const double none : {0.0, -3.0, nan}) {
    EXPECT_EQ(receptor_rates({none, none}, 10).rods, 0);
    EXPECT_EQ(receptor_rates({none, none}, 10).cones, 0);
  }
}

TEST(Receptors, FitIntoTheRetinaAndCountByArea) {
  double covered = 0;
  for (const Receptor receptor : {Receptor::l_cone, Receptor::m_cone, Receptor::s_cone}) {
    covered += figures_of(receptor).aperture_um2 * figures_of(receptor).density_per_deg2 / retina_um2_per_deg2;
  }
  EXPECT_LT(covered, 1) << "cones of the fovea";
  const ReceptorFigures& rod = figures_of(Receptor::rod);
  EXPECT_LT(rod.aperture_um2 * rod.density_per_deg2 / retina_um2_per_deg2, 1) << "rods at 20 degrees";
  const ReceptorField one = rods_in(1, 30), half = rods_in(0.5, 30);
  EXPECT_NEAR(one.dark_counts, rod.density_per_deg2 * 0.1 * 0.01, 1e-9);
  EXPECT_NEAR(half.counts_per_cd_m2, 0.5 * one.counts_per_cd_m2, 1e-9 * one.counts_per_cd_m2);
  EXPECT_NEAR(one.counts_per_cd_m2, rod.density_per_deg2 * 0.1 * receptor_rates({0, 1}, 30).rods,
              1e-9 * one.counts_per_cd_m2);
  const ReceptorField cones = cones_in(2, 30);
  const double cones_there =
      2 * (figures_of(Receptor::l_cone).density_per_deg2 + figures_of(Receptor::m_cone).density_per_deg2);
  EXPECT_NEAR(cones.dark_counts, cones_there * 0.05 * 100, 1e-6);
  EXPECT_NEAR(cones.counts_per_cd_m2, cones_there * 0.05 * receptor_rates({1, 0}, 30).cones,
              1e-9 * cones.counts_per_cd_m2);
}

TEST(Isomerisations, RefuseWhatIsNoLightAndNoPupil) {
  const Spectrum light = *light_named("D65");
  for (const double bad : {-1.0, nan, inf}) {
    EXPECT_FALSE(isomerisations_per_s(Receptor::rod, light, bad)) << bad;
    EXPECT_FALSE(corneal_photons(light, bad)) << bad;
  }
  EXPECT_FALSE(isomerisations_per_s(Receptor::rod, *Spectrum::of({400, 500}, {1, -1}), 10));
}

}  // namespace
}  // namespace lowlux::isp
