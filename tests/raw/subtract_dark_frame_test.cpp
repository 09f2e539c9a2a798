#include "isp/raw/subtract_dark_frame.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

constexpr int width = 20, height = 16;

int code_at(int x, int y) { return 200 + (x * 7 + y * 13) % 400; }

RawFrame picture() {
  RawFrame frame;
  frame.raw = test::bayer_frame(width, height, BayerPhase::grbg, code_at);
  frame.raw.active = {2, 2, width - 4, height - 2};
  return frame;
}

// A pattern of its own in every pixel, about 256 DN.
DarkFrame pattern() {
  DarkFrame dark;
  dark.dn = Plane<float>(width - 4, height - 2);
  for (int y = 0; y < dark.dn.height(); ++y) {
    for (int x = 0; x < dark.dn.width(); ++x) dark.dn.at(x, y) = static_cast<float>(256 + (x * y) % 5 + 0.25 * x);
  }
  dark.mean_dn = {256, 257, 258, 259};
  dark.noise_std_dn = {3, 3, 4, 4};
  return dark;
}

TEST(SubtractDarkFrame, EachPixelLosesItsOwnDarkAndKeepsItsSign) {
  InlineExecutor executor;
  const RawFrame frame = picture();
  const DarkFrame dark = pattern();
  const auto black = black_of(frame.raw, dark);
  ASSERT_TRUE(black);
  Plane<float> out(width - 4, height - 2);
  to_fraction(frame.raw, dark, *black, out.view(), executor);
  int negative = 0;
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      const double light = code_at(x + 2, y + 2) - static_cast<double>(dark.dn.at(x, y));
      EXPECT_NEAR(out.at(x, y), light / (4095 - dark.mean_dn[site_of(x, y)]), 1e-7);  // float rounding below 0.2
      negative += out.at(x, y) < 0;
    }
  }
  EXPECT_GT(negative, 0);
}

TEST(SubtractDarkFrame, ASaturatedHotPixelStaysWhiteAndLeavesNoDarkDot) {
  InlineExecutor executor;
  RawFrame frame = picture();
  DarkFrame dark = pattern();
  dark.dn.at(4, 4) = 2000;
  for (const int code : {4094, 4095}) {
    frame.raw.dn.at(6, 6) = static_cast<std::uint16_t>(code);
    Plane<float> out(width - 4, height - 2);
    to_fraction(frame.raw, dark, *black_of(frame.raw, dark), out.view(), executor);
    EXPECT_NEAR(out.at(4, 4), code == 4095 ? 1.0 : 2094.0 / (4095 - 256), 1e-6);
  }
}

TEST(SubtractDarkFrame, TheBlackPointSaysThatNothingIsLeftToTakeOff) {
  const auto black = black_of(picture().raw, pattern());
  ASSERT_TRUE(black);
  EXPECT_EQ(black->source, BlackPoint::Source::dark_frame);
  EXPECT_EQ(black->holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_EQ(black->dark_mean_e, PerSite<double>{});
  EXPECT_EQ(black->pedestal_dn, pattern().mean_dn);
  EXPECT_EQ(black->noise_std_dn, pattern().noise_std_dn);
}

TEST(SubtractDarkFrame, FramesThatDoNotFitAreRefused) {
  const auto refused = [](auto change) {
    RawFrame frame = picture();
    DarkFrame dark = pattern();
    change(frame.raw, dark);
    const auto black = black_of(frame.raw, dark);
    return black ? std::optional<ErrorCode>{} : black.error().code;
  };
  EXPECT_FALSE(refused([](RawDn&, DarkFrame&) {}));
  EXPECT_EQ(refused([](RawDn& raw, DarkFrame&) { raw.active.width -= 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(refused([](RawDn&, DarkFrame& d) { d.dn = {}; }), ErrorCode::invalid_argument);
  EXPECT_EQ(refused([](RawDn& raw, DarkFrame&) { raw.layout = SensorLayout::linear_rgb; }), ErrorCode::unsupported);
  EXPECT_EQ(refused([](RawDn&, DarkFrame& d) { d.mean_dn[2] = 4095; }), ErrorCode::malformed);
  EXPECT_EQ(refused([](RawDn&, DarkFrame& d) { d.mean_dn[2] = std::nan(""); }), ErrorCode::malformed);
  EXPECT_EQ(refused([](RawDn&, DarkFrame& d) { d.unknown = {{0, 0, 16, 8}}; }), ErrorCode::malformed);
}

TEST(SubtractDarkFrame, WhatIsMeasuredOnHasTheMeansLeftInAndNoPattern) {
  InlineExecutor executor;
  RawFrame frame = picture();
  frame.noise = NoiseProfile{.scale = {1, 2, 3}};
  const DarkFrame dark = pattern();
  const RawFrame measured = measurable_without_dark(frame, dark, *black_of(frame.raw, dark), executor);
  EXPECT_EQ(measured.raw.active, (Rect{0, 0, width - 4, height - 2}));
  EXPECT_EQ(measured.raw.phase, frame.raw.phase);
  EXPECT_EQ(measured.noise->scale[1], 2);
  for (int y = 0; y < height - 2; ++y) {
    for (int x = 0; x < width - 4; ++x) {
      const double expected =
          code_at(x + 2, y + 2) - static_cast<double>(dark.dn.at(x, y)) + dark.mean_dn[site_of(x, y)];
      EXPECT_NEAR(measured.raw.dn.at(x, y), expected, 0.5);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
