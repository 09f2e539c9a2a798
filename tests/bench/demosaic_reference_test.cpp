#include "isp/bench/peers/demosaic_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/reference/raw_to_rgb_ref.h"

namespace lowlux::isp {
namespace {

/// A mosaic of values that are no rule, in another phase, odd sizes.
Plane<float> scattered(int width, int height) {
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.at(x, y) = static_cast<float>((31 * x + 17 * y + x * y) % 23) / 23;
  }
  return out;
}

DoublePlanes planes(int width, int height) { return {Plane<double>(width, height), {width, height}, {width, height}}; }

TEST(DemosaicReference, MalvarIsThatOfAnotherWriting) {
  const Plane<float> values = scattered(13, 9);
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    const SignedMosaic mosaic{values.view(), phase, {2, 1, 1, 1.5f}};
    DoublePlanes out = planes(13, 9);
    demosaic_malvar(mosaic, out);
    const reference::LinearisedMosaic linear = reference::linearised(mosaic);
    for (int y = 0; y < 9; ++y) {
      for (int x = 0; x < 13; ++x) {
        const reference::Rgb expected = reference::malvar(linear, x, y);
        // double, in another order
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(out[c].at(x, y), expected[c], 1e-12) << x << ' ' << y;
      }
    }
  }
}

TEST(DemosaicReference, BilinearIsExactOnPlanesAndTakesTheNearest) {
  Plane<float> slope(12, 10);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 12; ++x) slope.at(x, y) = static_cast<float>(2 * x - 3 * y);
  }
  DoublePlanes out = planes(12, 10);
  demosaic_bilinear({slope.view(), BayerPhase::gbrg, {1, 1, 1, 1}}, out);
  for (int y = 1; y < 9; ++y) {
    for (int x = 1; x < 11; ++x) {
      for (const auto& plane : out) EXPECT_EQ(plane.at(x, y), 2 * x - 3 * y);  // small whole numbers
    }
  }
  Plane<float> one_red(6, 6);
  std::fill_n(one_red.data(), one_red.size(), 0.0f);
  one_red.at(2, 2) = 8;  // red of RGGB
  DoublePlanes spread = planes(6, 6);
  demosaic_bilinear({one_red.view(), BayerPhase::rggb, {1, 1, 1, 1}}, spread);
  EXPECT_EQ(spread[0].at(2, 2), 8);
  EXPECT_EQ(spread[0].at(3, 2), 4);
  EXPECT_EQ(spread[0].at(2, 1), 4);
  EXPECT_EQ(spread[0].at(1, 1), 2);
  EXPECT_EQ(spread[1].at(2, 2), 0);
}

TEST(DemosaicReference, EnlargedMeansOfASlopeAreTheSlope) {
  SceneLinear half(4, 3);
  for (Plane<float>& plane : half.plane) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 4; ++x) plane.at(x, y) = static_cast<float>(2 * x + 0.5 + 8 * (2 * y + 0.5));
    }
  }
  const SceneLinear whole = enlarged_twice(std::as_const(half).view(), 9, 7);  // of odd sizes the last were left out
  for (int y = 1; y < 5; ++y) {
    for (int x = 1; x < 7; ++x) EXPECT_EQ(whole.plane[1].at(x, y), static_cast<float>(x + 8 * y));
  }
  EXPECT_EQ(whole.plane[2].at(0, 0), half.plane[2].at(0, 0));
  EXPECT_EQ(whole.plane[2].at(8, 6), half.plane[2].at(3, 2));
}

}  // namespace
}  // namespace lowlux::isp
