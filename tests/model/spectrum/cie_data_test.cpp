#include "isp/model/spectrum/cie_data.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lowlux::isp {
namespace {

TEST(CieData, ColourMatchingFunctionsHaveTheirPublishedSums) {
  const double expected[] = {106.8551, 106.8564, 106.8461};  // 380..780 nm at 1 nm, four digits
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (int nm = 380; nm <= 780; ++nm) sum += cie_1931_observer()[c].at(nm);
    EXPECT_NEAR(sum, expected[c], 1e-4);
    EXPECT_EQ(cie_1931_observer()[c].wavelengths_nm().front(), 360);
    EXPECT_EQ(cie_1931_observer()[c].wavelengths_nm().back(), 830);
  }
}

struct NamedXy {
  const char* name;
  Xy xy;
};

TEST(CieData, IlluminantsAndLampsHaveTheirChromaticities) {
  const NamedXy published[] = {
      {"A", {0.44758, 0.40745}},            // CIE 15:2018 table T.3
      {"D50", {0.34567, 0.35851}},          //
      {"D65", {0.31272, 0.32903}},          //
      {"E", {1.0 / 3, 1.0 / 3}},            //
      {"FL2", {0.3721, 0.3751}},            // CIE 15:2018 table T.6
      {"HPS_generic", {0.52168, 0.41797}},  // NIST lamp set
      {"LPS", {0.57515, 0.42423}},         {"mercury_clear_H38HT100", {0.3112, 0.38294}},
  };
  for (const NamedXy& light : published) {
    const auto spectrum = light_named(light.name);
    ASSERT_TRUE(spectrum) << light.name;
    const Xy xy = *xy_of(xyz_of(*spectrum));
    // 1e-4: tables of 380..780 nm summed in steps of 5 nm; halving the end samples (trapezium) moves xy by 1e-5
    EXPECT_NEAR(xy.x, light.xy.x, 1e-4) << light.name;
    EXPECT_NEAR(xy.y, light.xy.y, 1e-4) << light.name;
  }
}

TEST(CieData, EveryNamedLightIsThereAndShines) {
  const auto names = light_names();
  EXPECT_EQ(names.size(), 34u + 21u);
  for (const auto name : names) {
    const auto light = light_named(name);
    ASSERT_TRUE(light) << name;
    EXPECT_GT(xyz_of(*light).y, 0) << name;
    EXPECT_EQ(light->size(), 81u) << name;
  }
  EXPECT_FALSE(light_named("candle"));
  EXPECT_FALSE(light_named("wavelength_nm"));
  EXPECT_FALSE(light_named(""));
}

TEST(CieData, APerfectDiffuserHasTheColourOfTheLight) {
  const Spectrum light = *light_named("D50");
  const Spectrum diffuser = *Spectrum::of({300, 900}, {1, 1});
  const Xyz colour = *xyz_of_reflectance(diffuser, light);
  const Xyz sum = xyz_of(light);
  EXPECT_NEAR(colour.y, 1, 1e-14);
  EXPECT_NEAR(colour.x, sum.x / sum.y, 1e-14);
  EXPECT_NEAR(colour.z, sum.z / sum.y, 1e-14);
  EXPECT_FALSE(xyz_of_reflectance(diffuser, *Spectrum::of({400, 500}, {0, 0})));
}

}  // namespace
}  // namespace lowlux::isp
