#include "isp/base/spectrum.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace lowlux {
namespace {

Spectrum ramp() { return *Spectrum::of({400, 410, 440}, {1, 2, 8}); }

TEST(Spectrum, IsLinearBetweenNodesOfUnequalStepsAndZeroOutside) {
  const Spectrum s = ramp();
  EXPECT_DOUBLE_EQ(s.at(400), 1);
  EXPECT_DOUBLE_EQ(s.at(405), 1.5);
  EXPECT_DOUBLE_EQ(s.at(425), 5);
  EXPECT_DOUBLE_EQ(s.at(440), 8);
  EXPECT_EQ(s.at(399.999), 0);
  EXPECT_EQ(s.at(440.001), 0);
  EXPECT_EQ(s.at(std::numeric_limits<double>::quiet_NaN()), 0);
}

TEST(Spectrum, IntegralIsTheAreaUnderItsLines) {
  EXPECT_DOUBLE_EQ(integrate(ramp()), 15 + 150);  // two trapezia
  EXPECT_DOUBLE_EQ(integrate(ramp(), [](double nm) { return nm == 410 ? 1. : 0.; }), 2 * 0.5 * (10 + 30));
}

TEST(Spectrum, ResamplingKeepsTheIntegralWhenItKeepsTheNodes) {
  const std::vector<double> finer{400, 403, 410, 411, 430, 440};
  const auto resampled = resample(ramp(), finer);
  ASSERT_TRUE(resampled);
  EXPECT_EQ(resampled->size(), finer.size());
  EXPECT_NEAR(integrate(*resampled), integrate(ramp()), 1e-12);  // rounding of a sum of five terms
}

TEST(Spectrum, RefusesFilesThatAreNotTables) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Spectrum::of({}, {}));
  EXPECT_FALSE(Spectrum::of({400}, {1}));
  EXPECT_FALSE(Spectrum::of({400, 410}, {1, 2, 3}));
  EXPECT_FALSE(Spectrum::of({400, 410}, {1, nan}));
  EXPECT_FALSE(Spectrum::of({400, nan}, {1, 2}));
  EXPECT_FALSE(Spectrum::of({410, 400}, {1, 2}));
  const auto twice = Spectrum::of({400, 400}, {1, 2});
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().message.find("must rise"), std::string::npos);
  EXPECT_FALSE(resample(ramp(), std::vector<double>{410, 405}));
}

}  // namespace
}  // namespace lowlux
