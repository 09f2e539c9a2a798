#include "isp/raw/to_linear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "isp/raw/black_point.h"
#include "tests/support/executors.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

TEST(ToFraction, KeepsValuesBelowBlackAndAboveWhite) {
  RawDn raw = test::bayer_frame(6, 5, BayerPhase::grbg, [](int x, int y) { return 100 + 50 * x + y; });
  raw.white_dn = {300, 310, 320};
  raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {150.25, 151, 152, 153}};
  const BlackPoint black = *choose_black(raw, {BlackChoice::metadata});
  const RawFraction out = to_fraction(raw, black, one_thread);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 6; ++x) {
      const double b = black.pedestal_dn[site_of(x, y)];
      const double w = raw.white_dn[static_cast<int>(colour_at(raw.phase, x, y))];
      EXPECT_NEAR(out.value.at(x, y), (100 + 50 * x + y - b) / (w - b), 1e-6);  // float of numbers near 1
    }
  }
  EXPECT_LT(out.value.at(0, 0), 0);
  EXPECT_GT(out.value.at(5, 4), 1);
}

TEST(ToElectrons, InOnePassHasTheBitsOfBothSteps) {
  RawDn raw = test::bayer_frame(43, 31, BayerPhase::gbrg, [](int x, int y) { return (977 * x + 331 * y) % 4096; });
  raw.active = {3, 2, 37, 27};
  raw.white_dn = {4000, 4010, 4020};
  const PerSite<double> electrons{1234.5, 777.7, 778.9, 2001.1};
  BlackPoint black;
  black.pedestal_dn = {150.25, 151, 152.5, 149.9};
  PoolExecutor three(3);
  for (const bool pattern : {false, true}) {
    if (pattern) black.pattern = BlackLevel{.rows = 1, .columns = 3, .pattern_dn = {150, 151.5, 149}};
    const RawElectrons expected = to_electrons(to_fraction(raw, black, one_thread), electrons, one_thread);
    Plane<float> found(37, 27);
    to_electrons(raw, black, electrons, found.view(), three);
    EXPECT_EQ(std::memcmp(found.data(), expected.value.data(), found.size() * sizeof(float)), 0);
  }
}

TEST(ToFraction, FourByFourPatternsAndRowOffsetsReachEveryPixel) {
  RawDn raw = test::bayer_frame(9, 7, BayerPhase::rggb, [](int, int) { return 1000; });
  BlackLevel tag{.rows = 4, .columns = 4, .pattern_dn = std::vector<double>(16)};
  for (int i = 0; i < 16; ++i) tag.pattern_dn[i] = 100 + i;
  tag.row_dn = {0, 1, 2, 3, 4, 5, 6};
  raw.black_tag = tag;
  const RawFraction out = to_fraction(raw, *choose_black(raw, {BlackChoice::automatic}), one_thread);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      const double b = 100 + 4 * (y % 4) + x % 4 + y;
      // The mean of the pattern, and of the offsets of rows, of which even and odd ones count as much.
      const double mean = 100 + 7.5 + ((0 + 2 + 4 + 6) / 4.0 + (1 + 3 + 5) / 3.0) / 2;
      EXPECT_NEAR(out.value.at(x, y), (1000 - b) / (4095 - mean), 1e-6);
    }
  }
}

TEST(ToFraction, RowsOfOtherBlacksHaveOneGainAndSaturateAtWhite) {
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::linear_rgb}) {
    for (const bool alternating : {false, true}) {  // as two converters leave it
      const int samples = layout == SensorLayout::bayer ? 1 : 3;
      RawDn raw;
      raw.layout = layout;
      raw.active = {0, 0, 4, 8};
      raw.white_dn = {2000, 2000, 2000};
      raw.black_tag = BlackLevel{.samples = samples, .pattern_dn = std::vector<double>(samples, 100)};
      for (int y = 0; y < 8; ++y) raw.black_tag->row_dn.push_back(alternating ? 350 * (y % 2) : 50 * y);
      const double range = 1900 - 175;  // the mean of the offsets
      for (const int signal : {-20, 0, 300, 5000}) {
        raw.dn = Plane<std::uint16_t>(4 * samples, 8);
        for (int y = 0; y < 8; ++y) {
          const double code = std::min(100 + raw.black_tag->row_dn[y] + signal, 2000.0);
          for (int x = 0; x < 4 * samples; ++x) raw.dn.at(x, y) = static_cast<std::uint16_t>(code);
        }
        const BlackPoint black = *choose_black(raw, {BlackChoice::metadata});
        std::array<Plane<float>, 3> planes{{{4, 8}, {4, 8}, {4, 8}}};
        if (samples == 1) {
          planes[0] = to_fraction(raw, black, one_thread).value;
        } else {
          to_fraction_rgb(raw, black, {planes[0].view(), planes[1].view(), planes[2].view()}, one_thread);
        }
        for (int c = 0; c < samples; ++c) {
          for (int y = 0; y < 8; ++y) {
            const double expected = signal < 1000 ? signal / range : 1;
            for (int x = 0; x < 4; ++x) EXPECT_FLOAT_EQ(planes[c].at(x, y), static_cast<float>(expected)) << c << y;
          }
        }
      }
    }
  }
}

TEST(ToFraction, UsesTheActiveAreaOnlyAndAnyThreadCountAgrees) {
  RawDn raw = test::bayer_frame(41, 33, BayerPhase::bggr, [](int x, int y) { return 7 * x + 3 * y; });
  raw.active = {3, 5, 30, 21};
  const BlackPoint black = *choose_black(raw, {BlackChoice::metadata});
  const RawFraction one = to_fraction(raw, black, one_thread);
  EXPECT_EQ(one.value.width(), 30);
  EXPECT_EQ(one.value.height(), 21);
  EXPECT_FLOAT_EQ(one.value.at(0, 0), (7 * 3 + 3 * 5) / 4095.0f);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const RawFraction many = to_fraction(raw, black, pool);
    EXPECT_EQ(std::memcmp(one.value.data(), many.value.data(), one.value.size() * sizeof(float)), 0);
  }
}

TEST(ToFractionRgb, ScalesEachSampleByItsOwnBlackAndWhite) {
  RawDn raw;
  raw.layout = SensorLayout::linear_rgb;
  raw.dn = Plane<std::uint16_t>(6, 1);
  for (int i = 0; i < 6; ++i) raw.dn.at(i, 0) = static_cast<std::uint16_t>(100 * (i + 1));
  raw.active = {0, 0, 2, 1};
  raw.white_dn = {1000, 2000, 3000};
  raw.black_tag = BlackLevel{.samples = 3, .pattern_dn = {10, 20, 30}};
  Plane<float> planes[3] = {{2, 1}, {2, 1}, {2, 1}};
  to_fraction_rgb(raw, *choose_black(raw, {BlackChoice::metadata}),
                  {planes[0].view(), planes[1].view(), planes[2].view()}, one_thread);
  EXPECT_FLOAT_EQ(planes[0].at(1, 0), (400 - 10) / 990.0f);
  EXPECT_FLOAT_EQ(planes[1].at(0, 0), (200 - 20) / 1980.0f);
  EXPECT_FLOAT_EQ(planes[2].at(1, 0), (600 - 30) / 2970.0f);
}

TEST(Electrons, ShotNoiseScaleOfTheNoiseProfileIsOneElectron) {
  RawDn raw = test::bayer_frame(4, 4, BayerPhase::rggb, [](int, int) { return 1000; });
  // 5000 electrons at white: a fraction x has variance x / 5000.
  const auto electrons = electrons_at_white(raw, {.scale = {2e-4, 2e-4, 4e-4}, .offset = {1e-6, 1e-6, 1e-6}});
  ASSERT_TRUE(electrons);
  EXPECT_NEAR((*electrons)[0], 5000, 1e-9);
  EXPECT_NEAR((*electrons)[3], 2500, 1e-9);
  EXPECT_FALSE(electrons_at_white(raw, {.scale = {0, 1, 1}, .offset = {}}));
  EXPECT_FALSE(electrons_at_white(raw, {.scale = {NAN, 1, 1}, .offset = {}}));
}

TEST(Electrons, DarkIsSubtractedOnlyWhereTheBlackPointDidNotHoldIt) {
  const RawDn raw = test::bayer_frame(4, 4, BayerPhase::rggb, [](int, int) { return 819; });
  BlackPoint black = *choose_black(raw, {BlackChoice::metadata});
  const PerSite<double> electrons{1000, 1000, 1000, 1000};
  const auto signal_of = [&](const BlackPoint& b) {
    return subtract_dark(to_electrons(to_fraction(raw, b, one_thread), electrons, one_thread), b, one_thread);
  };
  EXPECT_FLOAT_EQ(signal_of(black).value.at(2, 2), 200);
  black.dark_mean_e = {150, 250, 250, 150};
  EXPECT_FLOAT_EQ(signal_of(black).value.at(2, 2), 50);
  EXPECT_FLOAT_EQ(signal_of(black).value.at(1, 0), -50);  // below zero is data
}

}  // namespace
}  // namespace lowlux::isp
