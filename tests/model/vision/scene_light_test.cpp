#include "isp/model/vision/scene_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double rounding = 1e-12;  // relative: a few dozen operations in double

// A triangle of 1 nm at a node of both observers: its integrals are the functions' values there.
Spectrum line_at(double nm) { return *Spectrum::of({nm - 1, nm, nm + 1}, {0, 1, 0}); }

TEST(SceneLight, OfALineHasTheRatioOfTheObservers) {
  for (const double nm : {450.0, 507.0, 555.0, 589.0}) {
    const auto light = light_of_spectrum("line", line_at(nm));
    ASSERT_TRUE(light) << nm;
    const double ratio = 1700 * scotopic_observer().at(nm) / (683 * cie_1931_observer()[1].at(nm));
    EXPECT_NEAR(light->scotopic_ratio, ratio, rounding * ratio) << nm;
    EXPECT_EQ(light->name, "line");
  }
}

// S/P of the specification is of 1 nm sums with 1699/683; here it is 1700/683 and sums over 5 nm, off by up to 1e-3.
TEST(SceneLight, OfALampIsFoundInAnyCase) {
  struct Row {
    const char* name;
    double ratio;
  };
  for (const Row& row : {Row{"D65", 2.4631}, {"a", 1.4115}, {"E", 2.2598}}) {
    const auto light = light_of_lamp(row.name);
    ASSERT_TRUE(light);
    EXPECT_NEAR(light->scotopic_ratio / row.ratio, 1700.0 / 1699.0, 1e-3) << row.name;
  }
  const auto sodium = light_of_lamp("hps_GENERIC");
  ASSERT_TRUE(sodium);
  EXPECT_EQ(sodium->name, "HPS_generic");
  ASSERT_TRUE(sodium->white && sodium->spectrum);
  EXPECT_TRUE(light_of_lamp("halogen")) << "a laboratory lamp";
  for (const std::string_view name : lamp_names()) EXPECT_TRUE(light_of_lamp(name)) << name;
  const auto unknown = light_of_lamp("candle");
  ASSERT_FALSE(unknown);
  for (const char* name : {"'candle'", "LPS", "LED-B3", "Halogen"}) {
    EXPECT_NE(unknown.error().message.find(name), std::string::npos) << name;
  }
}

TEST(SceneLight, RefusesRatiosThatTheTablesDoNotHold) {
  EXPECT_EQ(light_of_ratio(0.1)->scotopic_ratio, 0.1);
  EXPECT_EQ(light_of_ratio(60)->scotopic_ratio, 60);
  EXPECT_FALSE(light_of_ratio(60)->spectrum);
  for (const double ratio : {0.0999, 60.01, 0.0, -1.0, HUGE_VAL, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(light_of_ratio(ratio)) << ratio;
  }
  const auto red = light_of_spectrum("red", line_at(700));
  ASSERT_FALSE(red);
  EXPECT_NE(red.error().message.find("0.1 to 60"), std::string::npos) << red.error().message;
  const auto dark = light_of_spectrum("dark", *Spectrum::of({400, 700}, {0, 0}));
  ASSERT_FALSE(dark);
  EXPECT_NE(dark.error().message.find("no luminance"), std::string::npos) << dark.error().message;
  EXPECT_FALSE(light_of_spectrum("infrared", *Spectrum::of({850, 900}, {1, 1})));
}

// The second figure is that of CIECAM02's example with L_A = 318.31 (CIE 159:2004; colour-science prints 0.9944687801).
TEST(DegreeOfAdaptation, IsThatOfCiecam02) {
  EXPECT_NEAR(degree_of_adaptation(0), 1 - std::exp(-42.0 / 92) / 3.6, rounding);
  EXPECT_NEAR(degree_of_adaptation(318.31), 0.9944687801, 1e-10);
  EXPECT_EQ(degree_of_adaptation(-1), degree_of_adaptation(0));
  EXPECT_EQ(degree_of_adaptation(1e9), 1);
}

TEST(IncompleteAdaptation, LeavesTheWhiteBetweenTheTwo) {
  const Xy sodium{0.575, 0.424};
  const Xyz from = *xyz_of(sodium), to = *xyz_of(white_d65);
  for (const double degree : {0.0, 0.3, 0.82, 1.0}) {
    const auto matrix = incomplete_adaptation(sodium, white_d65, degree);
    ASSERT_TRUE(matrix) << degree;
    const Vector3 seen = *matrix * vector_of(to);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(seen[i], degree * vector_of(to)[i] + (1 - degree) * vector_of(from)[i], rounding) << degree;
    }
  }
}

TEST(IncompleteAdaptation, ChangesNothingInTheWhiteItAdaptsTo) {
  for (const auto& matrix :
       {*incomplete_adaptation(white_d65, white_d65, 0.2), *incomplete_adaptation({0.5, 0.4}, white_d65, 1)}) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(matrix[i][j], i == j, rounding);
    }
  }
  EXPECT_FALSE(incomplete_adaptation({0.3, 0}, white_d65, 0.5)) << "no XYZ";
  EXPECT_FALSE(incomplete_adaptation({0.7347, 0.2653}, white_d65, 0)) << "700 nm: a response below 0";
  EXPECT_TRUE(incomplete_adaptation({0.7347, 0.2653}, white_d65, 0.82));
}

}  // namespace
}  // namespace lowlux::isp
