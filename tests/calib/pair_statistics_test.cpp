#include "calib/flat/pair_statistics.h"

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/frames.h"

namespace lowlux::calib {
namespace {

using test::bayer_frame;

TEST(PairStatistics, OfAFrameAndItsNegativeAreClosedForms) {
  // b - a is 2 or -2 by columns of sites; a and b are as far from 100 in opposite directions.
  const auto at = [](int sign) { return [sign](int x, int) { return 100 + sign * ((x / 2) % 2 == 0 ? 1 : -1); }; };
  const auto found =
      measure_pair(bayer_frame(128, 64, BayerPhase::rggb, at(-1)), bayer_frame(128, 64, BayerPhase::rggb, at(1)));
  ASSERT_TRUE(found);
  for (const SiteStatistics& s : found->site) {
    const double n = 64 * 32;
    EXPECT_EQ(s.pixels, 64 * 32);
    EXPECT_EQ(s.rows, 32);
    EXPECT_EQ(s.mean_dn, 100);
    EXPECT_EQ(s.drift_dn, 0);
    EXPECT_NEAR(s.variance_dn2, 4 * n / (2 * (n - 1)), 1e-12);
    EXPECT_NEAR(s.covariance_dn2, -1024.0 / 1023, 1e-12);  // blocks of 32 x 32 sites
    EXPECT_EQ(s.fraction_at_zero, 0);
    EXPECT_EQ(s.fraction_at_white, 0);
  }
}

TEST(PairStatistics, OfEqualFramesHaveNoTemporalVariance) {
  const RawDn raw = bayer_frame(64, 64, BayerPhase::gbrg, [](int x, int y) { return (x * 37 + y * 11) % 300; });
  const auto found = measure_pair(raw, raw);
  ASSERT_TRUE(found);
  for (const SiteStatistics& s : found->site) {
    EXPECT_EQ(s.variance_dn2, 0);
    EXPECT_EQ(s.row_variance_dn2, 0);
    EXPECT_GT(s.covariance_dn2, 0);
  }
}

TEST(PairStatistics, TellRowsFromPixels) {
  std::mt19937 engine(3);
  std::normal_distribution<double> normal;
  constexpr int side = 512;
  const auto noisy = [&] {
    std::vector<double> row(side);
    for (double& r : row) r = 20 * normal(engine);
    return bayer_frame(side, side, BayerPhase::rggb,
                       [&](int, int y) { return static_cast<int>(std::lround(1000 + row[y] + 30 * normal(engine))); });
  };
  const auto found = measure_pair(noisy(), noisy());
  ASSERT_TRUE(found);
  for (const SiteStatistics& s : found->site) {
    // Half the variance of 256 differences of rows: relative error sqrt(2 / 255), its pixels' share beside it.
    EXPECT_NEAR(s.row_variance_dn2, 400, 5 * std::sqrt(2.0 / 255) * (400 + 900.0 / 256));
    EXPECT_NEAR(s.variance_dn2, 1300, 5 * (std::sqrt(2.0 / 255) * 400 + std::sqrt(2.0 / 65536) * 900));
  }
}

TEST(PairStatistics, TellColumnsFromPixels) {
  std::mt19937 engine(4);
  std::normal_distribution<double> normal;
  constexpr int side = 512;
  std::vector<double> column(side), pixel(side * side);
  for (double& c : column) c = 20 * normal(engine);
  for (double& p : pixel) p = 30 * normal(engine);
  const auto noisy = [&] {
    return bayer_frame(side, side, BayerPhase::rggb, [&](int x, int y) {
      return static_cast<int>(std::lround(1000 + column[x] + pixel[side * y + x] + 10 * normal(engine)));
    });
  };
  const auto found = measure_pair(noisy(), noisy());
  ASSERT_TRUE(found);
  for (const SiteStatistics& s : found->site) {
    EXPECT_NEAR(s.column_covariance_dn2, 400, 5 * std::sqrt(2.0 / 255) * (400 + 1000.0 / 256));
  }
}

TEST(PairStatistics, CountClippedSamplesOfTheActiveAreaOnly) {
  RawDn raw = bayer_frame(40, 36, BayerPhase::rggb, [](int x, int) { return x < 8 ? 0 : 4095; });
  raw.active = {6, 2, 32, 32};
  const auto found = measure_pair(raw, raw);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->setting.width, 32);
  for (const SiteStatistics& s : found->site) {
    EXPECT_EQ(s.fraction_at_zero, 1.0 / 16);
    EXPECT_EQ(s.fraction_at_white, 15.0 / 16);
  }
}

TEST(PairStatistics, RefuseWhatIsNoPair) {
  const auto dn = [](int, int) { return 100; };
  const RawDn good = bayer_frame(64, 64, BayerPhase::rggb, dn);
  const auto code = [&](auto change) {
    RawDn bad = bayer_frame(64, 64, BayerPhase::rggb, dn);
    change(bad);
    const auto found = measure_pair(good, bad);
    EXPECT_EQ(found.has_value(), measure_pair(bad, good).has_value());
    return found ? std::optional<ErrorCode>() : found.error().code;
  };
  EXPECT_EQ(code([](RawDn&) {}), std::nullopt);
  EXPECT_EQ(code([](RawDn& r) { r.active = {0, 0, 62, 64}; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code([](RawDn& r) { r.phase = BayerPhase::grbg; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code([](RawDn& r) { r.info.make = "Other"; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code([](RawDn& r) { r.info.exposure_s = 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code([](RawDn& r) { r.layout = SensorLayout::monochrome; }), ErrorCode::invalid_argument);
  EXPECT_EQ(code([](RawDn& r) { r.layout = SensorLayout::linear_rgb; }), ErrorCode::unsupported);
  EXPECT_EQ(code([](RawDn& r) { r.active = {0, 0, 8, 64}; }), ErrorCode::insufficient);
  EXPECT_EQ(code([](RawDn& r) { r.active = {}; }), ErrorCode::insufficient);
  EXPECT_EQ(code([](RawDn& r) { r.active = {1, 0, 64, 64}; }), ErrorCode::malformed);
  EXPECT_EQ(code([](RawDn& r) { r.active.x = std::numeric_limits<int>::max(); }), ErrorCode::malformed);
  EXPECT_EQ(code([](RawDn& r) { r.active.y = -1; }), ErrorCode::malformed);
  EXPECT_EQ(code([](RawDn& r) { r.white_dn[2] = std::nan(""); }), ErrorCode::malformed);
  EXPECT_EQ(code([](RawDn& r) { r.info.exposure_s = -1; }), ErrorCode::malformed);
  EXPECT_EQ(code([](RawDn& r) { r.info.temperature_c = std::nan(""); }), ErrorCode::malformed);
}

}  // namespace
}  // namespace lowlux::calib
