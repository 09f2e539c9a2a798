#include "calib/dark/dark_stack.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/frames.h"

namespace lowlux::calib {
namespace {

RawDn even_frame(int dn) {
  RawDn raw = test::bayer_frame(34, 20, BayerPhase::rggb, [&](int x, int y) { return x == 3 && y == 5 ? 0 : dn + x; });
  raw.info.exposure_s = 2;
  return raw;
}

TEST(DarkStack, MeanAndVarianceAreThoseOfEachPixel) {
  DarkStack stack;
  for (const int dn : {100, 103, 109}) ASSERT_TRUE(stack.add(even_frame(dn)));
  const auto group = stack.group();
  ASSERT_TRUE(group);
  EXPECT_EQ(group->frames, 3);
  EXPECT_FLOAT_EQ(group->mean_dn.at(7, 4), 111);
  EXPECT_FLOAT_EQ(group->variance_dn2.at(7, 4), (16 + 1 + 25) / 2.0f);
  EXPECT_EQ(group->mean_dn.at(3, 5), 0);
  EXPECT_EQ(group->variance_dn2.at(3, 5), 0);
  EXPECT_DOUBLE_EQ(group->fraction_at_zero[3], 1.0 / (17 * 10));
  EXPECT_EQ(group->fraction_at_zero[0], 0);
  EXPECT_NEAR(group->row_variance_dn2[0], 21, 1e-9);  // whole frames move: so do all rows
}

TEST(DarkStack, TellsRowsFromPixels) {
  std::mt19937 engine(4);
  std::normal_distribution<double> normal;
  DarkStack stack;
  constexpr int side = 256, frames = 8;
  for (int f = 0; f < frames; ++f) {
    std::vector<double> row(side);
    for (double& r : row) r = 5 * normal(engine);
    RawDn raw = test::bayer_frame(side, side, BayerPhase::rggb, [&](int, int y) {
      return static_cast<int>(std::lround(500 + row[y] + 12 * normal(engine)));
    });
    raw.info.exposure_s = 1;
    ASSERT_TRUE(stack.add(raw));
  }
  const auto group = stack.group();
  ASSERT_TRUE(group);
  for (const double variance : group->row_variance_dn2) {
    EXPECT_NEAR(variance, 25, 5 * std::sqrt(2.0 / (128 * (frames - 1))) * (25 + 144.0 / 128));
  }
}

TEST(DarkStack, RefusesFramesThatDoNotBelongTogether) {
  const auto refused = [](auto change) {
    DarkStack stack;
    RawDn raw = even_frame(100);
    raw.info.temperature_c = 20;
    EXPECT_TRUE(stack.add(raw));
    change(raw);
    return !stack.add(raw);
  };
  EXPECT_FALSE(refused([](RawDn&) {}));
  EXPECT_FALSE(refused([](RawDn& r) { r.info.temperature_c = 20.9; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.temperature_c = 21.1; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.temperature_c.reset(); }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.exposure_s = 3; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.model = "other"; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.active.width = 32; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.layout = SensorLayout::linear_rgb; }));
}

TEST(DarkStack, FlatsMayWarmUp) {
  DarkStack stack(StackedFrames::flats);
  for (const double temperature_c : {20.0, 24.0, 29.0}) {
    RawDn raw = even_frame(100);
    raw.info.temperature_c = temperature_c;
    EXPECT_TRUE(stack.add(raw));
  }
  RawDn other = even_frame(100);
  other.info.exposure_s = 3;
  EXPECT_FALSE(stack.add(other));
}

TEST(DarkStack, NeedsTwoFrames) {
  DarkStack stack;
  EXPECT_EQ(stack.group().error().code, ErrorCode::insufficient);
  ASSERT_TRUE(stack.add(even_frame(100)));
  EXPECT_EQ(stack.group().error().code, ErrorCode::insufficient);
  ASSERT_TRUE(stack.add(even_frame(100)));
  EXPECT_TRUE(stack.group());
}

}  // namespace
}  // namespace lowlux::calib
