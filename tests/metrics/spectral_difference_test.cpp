#include "isp/metrics/spectral_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace lowlux::isp {
namespace {

SceneLinear flat(const std::array<float, 3>& xyz, int side = 8) {
  SceneLinear out(side, side);
  for (int c = 0; c < 3; ++c) std::fill_n(out.plane[c].data(), out.plane[c].size(), xyz[c]);
  return out;
}

constexpr std::array<float, 3> grey{0.4752f, 0.5f, 0.5444f}, dark_grey{0.0950f, 0.1f, 0.1089f}, red{0.4f, 0.25f, 0.1f};

TEST(SpectralDifference, IsNoneForEqualChromaticitiesHoweverBright) {
  InlineExecutor one;
  EXPECT_NEAR(spectral_difference(flat(grey), flat(grey), one).jeffreys, 0, 1e-12);
  EXPECT_NEAR(spectral_difference(flat(grey), flat(dark_grey), one).jeffreys, 0, 1e-6) << "XYZ of four digits";
}

TEST(SpectralDifference, OfColoursIsPositiveAndJeffreysIsBothWaysTogether) {
  InlineExecutor one;
  PoolExecutor three(3);
  const SpectralDifference there = spectral_difference(flat(grey), flat(red), one);
  const SpectralDifference back = spectral_difference(flat(red), flat(grey), three);
  EXPECT_EQ(there.pixels, 64);
  EXPECT_GT(there.kullback_leibler, 0.01);
  EXPECT_NEAR(there.jeffreys, there.kullback_leibler + back.kullback_leibler, 1e-9);
  EXPECT_NEAR(there.jeffreys, back.jeffreys, 1e-9);
  EXPECT_NE(there.kullback_leibler, back.kullback_leibler);
}

TEST(SpectralDifference, LeavesOutPixelsWithoutAChromaticity) {
  InlineExecutor one;
  SceneLinear holes = flat(grey);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (Plane<float>& plane : holes.plane) {
    plane.at(0, 0) = 0;
    plane.at(1, 0) = nan;
  }
  EXPECT_EQ(spectral_difference(holes, flat(red), one).pixels, 62);
  const SpectralDifference none = spectral_difference(flat({0, 0, 0}), flat(red), one);
  EXPECT_EQ(none.pixels, 0);
  EXPECT_TRUE(std::isnan(none.jeffreys));
}

TEST(SpectralDifference, TakesImaginaryColoursForTheNearestLight) {
  InlineExecutor one;
  const SpectralDifference found = spectral_difference(flat(grey), flat({1, 0.05f, -0.2f}), one);
  EXPECT_EQ(found.pixels, 64);
  EXPECT_TRUE(std::isfinite(found.jeffreys));
}

}  // namespace
}  // namespace lowlux::isp
