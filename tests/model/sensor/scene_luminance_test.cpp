#include "isp/model/sensor/scene_luminance.h"

#include <gtest/gtest.h>

#include <limits>

namespace lowlux::isp {
namespace {

FrameInfo exposed(std::optional<double> f_number, std::optional<double> iso, std::optional<double> exposure_s) {
  FrameInfo info;
  info.f_number = f_number;
  info.iso = iso;
  info.exposure_s = exposure_s;
  return info;
}

TEST(SceneLuminance, IsAbout120NSquaredOverST) {
  EXPECT_DOUBLE_EQ(*saturation_luminance_cd_m2(exposed(1, 100, 0.01)), 120);
  EXPECT_DOUBLE_EQ(*saturation_luminance_cd_m2(exposed(2, 6400, 0.1)), 78.0 * 4 / (0.65 * 640));
}

TEST(SceneLuminance, SunnySixteenPutsADiffuserBelowSaturation) {
  // f/16, 1/100 s at ISO 100; a white in 100 klx of sun has 1e5 / pi cd/m2, and must just about saturate.
  const double limit = *saturation_luminance_cd_m2(exposed(16, 100, 0.01));
  EXPECT_GT(limit / (1e5 / 3.14159), 0.8);
  EXPECT_LT(limit / (1e5 / 3.14159), 1.2);
}

TEST(SceneLuminance, IsUnknownIfAnythingIsMissingOrNotPositive) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(saturation_luminance_cd_m2(exposed(std::nullopt, 100, 0.01)));
  EXPECT_FALSE(saturation_luminance_cd_m2(exposed(2, std::nullopt, 0.01)));
  EXPECT_FALSE(saturation_luminance_cd_m2(exposed(2, 100, std::nullopt)));
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    EXPECT_FALSE(saturation_luminance_cd_m2(exposed(bad, 100, 0.01)));
    EXPECT_FALSE(saturation_luminance_cd_m2(exposed(2, bad, 0.01)));
    EXPECT_FALSE(saturation_luminance_cd_m2(exposed(2, 100, bad)));
  }
  EXPECT_FALSE(saturation_luminance_cd_m2(exposed(1e200, 1, 1)));  // overflow is not a luminance
}

}  // namespace
}  // namespace lowlux::isp
