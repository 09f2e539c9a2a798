#include "isp/model/vision/night_eye.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace lowlux::isp {
namespace {

TEST(NightEye, InDaylightSeesEverything) {
  const NightEye eye = night_eye({100, 246});
  EXPECT_EQ(eye.state.m, 1);
  EXPECT_EQ(eye.chroma, 1);
  EXPECT_EQ(eye.blue, 0);
  EXPECT_EQ(eye.blur_std_deg, 0);
}

TEST(NightEye, LosesColourAndDetailStepByStep) {
  NightEye before = night_eye({100, 246});
  for (int i = 1; i <= 700; ++i) {
    const double light = 100 * std::pow(10.0, -0.01 * i);  // to 1e-5
    const NightEye eye = night_eye({light, 2.46 * light});
    ASSERT_LE(eye.state.m, before.state.m);
    ASSERT_LE(eye.chroma, before.chroma);
    ASSERT_GE(eye.blur_std_deg, before.blur_std_deg);
    // No step is seen: 0.01 decades move nothing by more than the steepest of the curves allows.
    ASSERT_LT(before.chroma - eye.chroma, 0.0059) << light;  // ln 10 / 4 per decade
    ASSERT_LT(std::fabs(eye.blue - before.blue), 0.003) << light;
    ASSERT_LT(eye.blur_std_deg, before.blur_std_deg * 1.03 + 0.003) << light;
    before = eye;
  }
  EXPECT_LT(before.chroma, 0.001);
  EXPECT_LT(before.blue, 0.01) << "rods alone see no colour";
}

// Shlaer's observers resolve about 50 cycles per degree in bright light, about 5 at 0.01 cd/m2 and 2 at 0.0001.
TEST(NightEye, HasTheAcuityOfShlaersObservers) {
  EXPECT_NEAR(visual_acuity_cpd(100), 17.25 * std::atan(3.15) + 25.72, 1e-12);
  EXPECT_NEAR(visual_acuity_cpd(100), 47.5, 0.1);
  EXPECT_NEAR(visual_acuity_cpd(0.01), 5.3, 0.1);
  EXPECT_NEAR(visual_acuity_cpd(1e-4), 1.87, 0.02);
  EXPECT_EQ(visual_acuity_cpd(0), 0.7);
}

TEST(NightEye, BlursToATenthOfTheContrastAtItsAcuityBesideDaylight) {
  for (const double light : {1e-4, 0.01, 1.0}) {
    const double f = visual_acuity_cpd(light), f0 = visual_acuity_cpd(100), s = blur_std_deg(light);
    const double contrast = std::exp(-2 * M_PI * M_PI * s * s * f * f);
    EXPECT_NEAR(contrast, 0.1 / std::exp(-std::log(10) * f * f / (f0 * f0)), 1e-9) << light;
  }
}

TEST(NightEye, SaturationFadesAsWanatAndMantiukFitted) {
  for (const auto& [light, share] : {std::pair{0.01, 0.084746},
                                     {0.05, 0.316456},
                                     {0.1, 0.480769},
                                     {0.5, 0.822368},
                                     {1.0, 0.902527},
                                     {2.0, 0.948767},
                                     {10.0, 0.989315}}) {
    EXPECT_NEAR(chroma_fraction(light) * (100 / 100.108), share, 6e-7) << light;
  }
  EXPECT_EQ(chroma_fraction(1000), 1);
}

TEST(NightEye, TintIsOfOneHueAndWithoutLuminance) {
  const Vector3 weight = (*rgb_to_xyz(primaries_rec709))[1];
  EXPECT_NEAR(weight[0] * rod_tint[0] + weight[1] * rod_tint[1] + weight[2] * rod_tint[2], 0, 2e-6);
}

TEST(NightEye, TakesScenesForDarkerTheLessLightTheyHave) {
  EXPECT_EQ(apparent_dimming_ev(100), 0);
  EXPECT_EQ(apparent_dimming_ev(1e4), 0);
  double before = 0;
  for (const double light : {30.0, 3.0, 0.3, 0.03, 0.003, 0.0003}) {
    EXPECT_LT(apparent_dimming_ev(light), before) << light;
    before = apparent_dimming_ev(light);
  }
  EXPECT_GT(before, -12);
}

TEST(NightEye, OfAbsurdFieldsIsFinite) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double light : {0.0, -1.0, 1e-300, 1e300, nan, infinity}) {
    for (const double rods : {0.0, -1.0, 1e-300, 1e300, nan, infinity}) {
      const NightEye eye = night_eye({light, rods});
      EXPECT_TRUE(std::isfinite(eye.chroma) && std::isfinite(eye.blue) && std::isfinite(eye.blur_std_deg));
      EXPECT_TRUE(eye.chroma >= 0 && eye.chroma <= 1 && eye.blue >= 0);
    }
    EXPECT_TRUE(std::isfinite(apparent_dimming_ev(light)));
  }
}

}  // namespace
}  // namespace lowlux::isp
