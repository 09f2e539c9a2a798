#include "isp/reproduce/cao_extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

using enum CaoExtrapolation;
using enum CaoDirection;

TEST(ExtrapolatedCaoWeights, ContinueTheLineFromTheLastTwoPublishedLevels) {
  // One step of the published levels below the last one, in the logarithm: 0.1^2 / 0.62 cd/m2.
  constexpr double one_step = 0.1 * 0.1 / 0.62;
  const CaoWeights by_logarithm = extrapolated_cao_weights(one_step, logarithm);
  EXPECT_NEAR(by_logarithm.k1, 2 * 0.173 - 0.0173, 1e-14);
  EXPECT_NEAR(by_logarithm.k2, 2 * 0.357 - 0.0101, 1e-14);
  const CaoWeights by_power = extrapolated_cao_weights(one_step, power);
  EXPECT_NEAR(by_power.k1, 0.173 * 0.173 / 0.0173, 1e-13);
  EXPECT_NEAR(by_power.k2, 0.357 * 0.357 / 0.0101, 1e-12);
  // 0.052 cd/m2 below the last level is a tenth of the step between the two.
  const CaoWeights linear = extrapolated_cao_weights(0.048, luminance);
  EXPECT_NEAR(linear.k1, 0.173 + 0.1 * (0.173 - 0.0173), 1e-14);
  EXPECT_NEAR(linear.k2, 0.357 + 0.1 * (0.357 - 0.0101), 1e-14);
}

TEST(ExtrapolatedCaoWeights, AreThePublishedOnesFromATenthOfACandelaUp) {
  for (const CaoExtrapolation extrapolation : {logarithm, luminance, power}) {
    for (const double level : {0.1, 0.3, 0.62, 5.0, 100.0}) {
      EXPECT_EQ(extrapolated_cao_weights(level, extrapolation).k1, cao_weights(level).k1) << level;
      EXPECT_EQ(extrapolated_cao_weights(level, extrapolation).k2, cao_weights(level).k2) << level;
    }
    EXPECT_NEAR(extrapolated_cao_weights(0.1 * (1 - 1e-12), extrapolation).k2, 0.357, 1e-9);  // continuous
  }
}

// Figures of an independent program (plain Python) for 10GY 6/10 under the equal-energy light. Relative to white: the
// digits of the colour.
TEST(CaoColour, IsThatOfAnIndependentProgram) {
  const Xyz chip{0.1606032669434043, 0.24927959169656155, 0.09498454809202682};
  const Xyz seen = cao_colour({logarithm, appearance}, 0.002, chip);
  EXPECT_NEAR(seen.x, 0.14962605107900387, 1e-12);
  EXPECT_NEAR(seen.y, 0.4867834224047348, 1e-12);
  EXPECT_NEAR(seen.z, 0.3528995863183716, 1e-12);
  const Xyz compensated = cao_colour({logarithm, compensation}, 0.002, chip);
  EXPECT_NEAR(compensated.x, 0.16457621542669226, 1e-12);
  EXPECT_NEAR(compensated.y, 0.16332059301756288, 1e-12);
  EXPECT_NEAR(compensated.z, 0.0016381866287743935, 1e-12);
}

TEST(CaoColour, CompensationIsTheInverseOfAppearance) {
  const Xyz colour{0.4, 0.3, 0.2};
  for (const CaoExtrapolation extrapolation : {logarithm, luminance, power}) {
    const Xyz seen = cao_colour({extrapolation, appearance}, 0.02, colour);
    const Xyz back = cao_colour({extrapolation, compensation}, 0.02, seen);
    // Relative to white: rounding times the condition of the matrices, about 100 with a power's weights.
    EXPECT_NEAR(back.x, colour.x, 1e-12);
    EXPECT_NEAR(back.y, colour.y, 1e-12);
    EXPECT_NEAR(back.z, colour.z, 1e-12);
  }
}

TEST(NegativeChromaticities, AppearByTheInverseAloneAndBelowTheLevelsOfAnIndependentProgram) {
  std::vector<Xyz> chips;
  for (const NamedSpectrum& chip : track_chips())
    chips.push_back(*xyz_of_reflectance(chip.spectrum, *light_named("E")));
  for (const CaoReading& reading : cao_readings().first(3)) {
    EXPECT_FALSE(negative_from_cd_m2(reading, chips, Coordinates::xyz, 1e-6));
  }
  const auto from = [&](CaoExtrapolation extrapolation, Coordinates coordinates) {
    return negative_from_cd_m2({extrapolation, compensation}, chips, coordinates, 1e-6);
  };
  EXPECT_FALSE(from(logarithm, Coordinates::xy));
  EXPECT_FALSE(from(luminance, Coordinates::xyz));
  ASSERT_TRUE(from(logarithm, Coordinates::xyz) && from(power, Coordinates::xy) && from(power, Coordinates::xyz));
  // cd/m2: levels are tried in steps of a hundredth.
  EXPECT_NEAR(*from(logarithm, Coordinates::xyz), 0.0015123727, 0.01 * 0.0015123727);
  EXPECT_NEAR(*from(power, Coordinates::xy), 0.0094629869, 0.01 * 0.0094629869);
  EXPECT_NEAR(*from(power, Coordinates::xyz), 0.063585968, 0.01 * 0.063585968);
}

TEST(NegativeChromaticities, OfAColourThatIsNegativeByDayStartAtTheFirstLevel) {
  const std::vector<Xyz> colours{{-0.5, 1, 0.1}};
  EXPECT_EQ(negative_from_cd_m2({logarithm, compensation}, colours, Coordinates::xy, 1e-3), 0.1);
}

}  // namespace
}  // namespace lowlux::isp
