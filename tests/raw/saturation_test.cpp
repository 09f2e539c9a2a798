#include "isp/raw/measure/saturation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

/// Light of all levels up to twice saturation, in a tenth of the image; the sensor saturates at `code`, give or take
/// one.
RawDn frame(int code, bool bright, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 0.4);
  return test::bayer_frame(300, 200, BayerPhase::rggb, [&](int x, int y) {
    const double light = x < 30 && bright ? 60.0 * (y + 1) : 200 + 2 * x;
    return std::clamp(static_cast<int>(std::lround(std::min<double>(light, code) + normal(random))), 0, 65535);
  });
}

BlackPoint black_of(double pedestal) { return {.pedestal_dn = {pedestal, pedestal, pedestal, pedestal}}; }

TEST(MeasuredSaturation, IsTheCodeAtWhichPixelsPileUp) {
  for (const int code : {3300, 3833, 4095, 4600}) {  // the white level that is stated is 4095
    for (const double found : measure_saturation(frame(code, true, 4), black_of(95))) {
      EXPECT_NEAR(found, (code - 95) / 4000.0, 1e-12) << code << " seed 4";
    }
  }
}

TEST(MeasuredSaturation, IsRelativeToTheLevelsOfEachColour) {
  RawDn bayer = frame(3833, true, 4);
  bayer.white_dn = {4095, 3900, 4000};
  const BlackPoint black{.pedestal_dn = {95, 100, 110, 90}};
  const std::array<double, 3> found = measure_saturation(bayer, black);
  EXPECT_NEAR(found[0], (3833 - 95) / 4000.0, 1e-12);
  EXPECT_NEAR(found[1], (3833 - 105) / 3795.0, 1e-12);
  EXPECT_NEAR(found[2], (3833 - 90) / 3910.0, 1e-12);
}

TEST(MeasuredSaturation, OfDemosaicedFramesIsThatOfEachChannel) {
  const std::array<RawDn, 3> channel{frame(3833, true, 4), frame(7900, true, 5), frame(6000, false, 6)};
  RawDn rgb;
  rgb.layout = SensorLayout::linear_rgb;
  rgb.active = rgb.default_crop = {0, 0, 300, 200};
  rgb.dn = Plane<std::uint16_t>(900, 200);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 900; ++x) rgb.dn.at(x, y) = channel[static_cast<std::size_t>(x % 3)].dn.at(x / 3, y);
  }
  rgb.white_dn = {4095, 8000, 6500};
  const std::array<double, 3> found = measure_saturation(rgb, {.pedestal_dn = {95, 0, 500, 500}});
  EXPECT_NEAR(found[0], (3833 - 95) / 4000.0, 1e-12);
  EXPECT_NEAR(found[1], 7900 / 8000.0, 1e-12);
  EXPECT_EQ(found[2], 1) << "no pixel is saturated";
}

TEST(MeasuredSaturation, IsTheStatedOneWhereNothingSaturates) {
  constexpr std::array<double, 3> stated{1, 1, 1};
  EXPECT_EQ(measure_saturation(frame(3833, false, 5), black_of(95)), stated);
  const RawDn even =
      test::bayer_frame(300, 200, BayerPhase::rggb, [](int x, int y) { return (67 * x + 131 * y) % 4096; });
  EXPECT_EQ(measure_saturation(even, black_of(0)), stated);
  RawDn floats = frame(3833, true, 6);
  floats.dn_float = Plane<float>(300, 200);
  std::fill_n(floats.dn_float.data(), floats.dn_float.size(), 3833.0f);
  floats.dn = {};
  EXPECT_EQ(measure_saturation(floats, black_of(95)), stated);
}

}  // namespace
}  // namespace lowlux::isp
