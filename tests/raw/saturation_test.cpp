#include "isp/raw/measure/saturation.h"

#include <gtest/gtest.h>

#include <algorithm>
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
    const double found = measure_saturation(frame(code, true, 4), black_of(95));
    EXPECT_NEAR(found, (code - 95) / 4000.0, 1e-12) << code << " seed 4";
  }
}

TEST(MeasuredSaturation, IsTheStatedOneWhereNothingSaturates) {
  EXPECT_EQ(measure_saturation(frame(3833, false, 5), black_of(95)), 1);
  const RawDn even =
      test::bayer_frame(300, 200, BayerPhase::rggb, [](int x, int y) { return (67 * x + 131 * y) % 4096; });
  EXPECT_EQ(measure_saturation(even, black_of(0)), 1);
  RawDn floats = frame(3833, true, 6);
  floats.dn_float = Plane<float>(300, 200);
  std::fill_n(floats.dn_float.data(), floats.dn_float.size(), 3833.0f);
  floats.dn = {};
  EXPECT_EQ(measure_saturation(floats, black_of(95)), 1);
}

}  // namespace
}  // namespace lowlux::isp
