#include "calib/profile/gain_profile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

using test::SensorBench;

/// Codes of a frame moved by `dn(x, y)`.
template <class Move>
RawDn moved(RawDn raw, const Move& dn) {
  for (int y = 0; y < raw.dn.height(); ++y) {
    for (int x = 0; x < raw.dn.width(); ++x) {
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::clamp(raw.dn.at(x, y) + dn(x, y), 0, 65535));
    }
  }
  return raw;
}

/// 200 e- of dark charge and 4 e- of read noise, without patterns.
SensorModel dark_200() {
  SensorModel s = test::modern_small();
  s.read_noise_e = 4;
  s.system_gain_dn_per_e = 2;
  s.full_well_e = 1800;
  s.dark_current_e_per_s = {200, 200, 200};
  s.prnu = 0;
  return s;
}

double mean_of(const PerSite<Estimate>& v) { return (v[0].value + v[1].value + v[2].value + v[3].value) / 4; }

double law_of_mean(const SensorModel& s, double time_s) {
  return s.black_level_dn + s.system_gain_dn_per_e * s.dark_current_e_per_s[1] * time_s;
}

TEST(BlackFigures, OfOneFrameHaveTheErrorOfTheLaw) {
  const SensorBench bench{.sensor = dark_200(), .width = 448, .height = 448};  // 50,176 pixels of each site
  const auto found = measure_black(bench.frame({1, 20}, 0));
  ASSERT_TRUE(found) << found.error().message;
  // (d + sigma^2) / M of denoise.md 3.4: 0.066 e- here.
  const double law_error_dn = 2 * std::sqrt((200 + 16.0 + 1.0 / 48) / 50176);
  // Its square is the sum of two variances, of 224 row and 224 column means, each with a relative error of sqrt(2 /
  // 223).
  const double error_of_error = std::sqrt(2 * 2.0 / 223) / 2;
  for (int site = 0; site < 4; ++site) {
    const Estimate& level = found->level_dn[site];
    EXPECT_NEAR(level.standard_error, law_error_dn, 5 * error_of_error * law_error_dn) << site;
    EXPECT_NEAR(level.value, law_of_mean(bench.sensor, 1), 3.5 * law_error_dn) << site;
    EXPECT_NEAR(found->deviation_dn[site], 2 * std::sqrt(216), 0.5);
  }
  EXPECT_EQ(found->frames, 1);
  EXPECT_LT(found->excluded_fraction, 1e-4);
}

TEST(BlackFigures, OfADimDarkAreAsGood) {
  SensorModel sensor = dark_200();
  sensor.read_noise_e = 1.5;
  sensor.dark_current_e_per_s = {2, 2, 2};
  const SensorBench bench{.sensor = sensor, .width = 448, .height = 448};
  const auto found = measure_black(bench.frame({1, 20}, 0));
  ASSERT_TRUE(found) << found.error().message;
  const double law_error_e = std::sqrt((2 + 2.25 + 1.0 / 48) / 50176);  // 0.009 e-
  for (const Estimate& level : found->level_dn) {
    EXPECT_NEAR((level.value - sensor.black_level_dn) / 2, 2, 3.5 * law_error_e);
  }
}

TEST(BlackFigures, OverManySeedsHaveNoBiasBeyondAFifthOfTheirError) {
  SensorBench bench{.sensor = dark_200(), .width = 128, .height = 128};
  constexpr int seeds = 100;
  double sum = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    bench.seed = static_cast<std::uint64_t>(seed);
    const auto found = measure_black(bench.frame({1, 20}, 0));
    ASSERT_TRUE(found);
    for (const Estimate& level : found->level_dn) sum += (level.value - law_of_mean(bench.sensor, 1)) / (4 * seeds);
  }
  const double one_error = 2 * std::sqrt(216.0 / 4096);
  EXPECT_LT(std::fabs(sum), 0.2 * one_error);  // its own deviation is a twentieth of the error
}

/// A sensor that counts photons, at 20 DN/e-.
SensorModel counting(double dark_e_per_s, double read_noise_e) {
  SensorModel s = dark_200();
  s.system_gain_dn_per_e = 20;
  s.read_noise_e = read_noise_e;
  s.full_well_e = 180;
  s.dark_current_e_per_s = {dark_e_per_s, dark_e_per_s, dark_e_per_s};
  return s;
}

// Over two decades of charge and one of read noise. A symmetric limit would exclude the pixels that hold an electron.
TEST(BlackFigures, KeepTheFewPixelsThatHoldDarkChargeWhereTheGainIsKnown) {
  constexpr unsigned seed = 20261125;
  std::mt19937_64 engine(seed);
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>()(engine));
  };
  for (int i = 0; i < 40; ++i) {
    const double dark_e = log_uniform(0.02, 5), read_e = log_uniform(0.1, 1);
    SensorBench bench{.sensor = counting(dark_e, read_e), .width = 256, .height = 256};
    bench.seed = seed + static_cast<unsigned>(i);
    for (const int frames : {1, 3}) {
      DarkStack stack;
      for (int k = 0; k < frames; ++k) ASSERT_TRUE(stack.add(bench.frame({1, 20}, static_cast<std::uint32_t>(k))));
      const auto found = measure_black(stack.average(), 20);
      ASSERT_TRUE(found) << found.error().message << ": seed " << seed << ", draw " << i;
      const double level_dn = mean_of(found->level_dn);
      const double error_dn = 20 * std::sqrt((dark_e + read_e * read_e + 1.0 / 4800) / (256 * 256 * frames));
      EXPECT_NEAR(level_dn, bench.sensor.black_level_dn + 20 * dark_e, 5 * error_dn)
          << dark_e << " e- over " << read_e << " e-, seed " << seed << ", draw " << i;
    }
  }
}

TEST(BlackFigures, LoseThatChargeWhereTheGainIsNotKnown) {
  const SensorBench bench{.sensor = counting(0.05, 0.15), .width = 256, .height = 256};
  const auto found = measure_black(bench.frame({1, 20}, 0));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(mean_of(found->level_dn), bench.sensor.black_level_dn + 20 * 0.01) << "of 0.05 e-";
}

TEST(BlackFigures, SeparateRowsColumnsAndPixels) {
  const SensorBench bench{.sensor = dark_200(), .width = 400, .height = 300};
  const RawDn plain = bench.frame({1, 20}, 0);
  const auto white = measure_black(plain);
  ASSERT_TRUE(white);
  // A deviation of 29.4 DN in 200 columns: row means of a site scatter by 2.1 DN; 5 deviations of that variance's root.
  EXPECT_LT(white->row_noise_dn, 0.9);
  EXPECT_LT(white->column_noise_dn, 0.9);
  const auto rows = measure_black(moved(bench.frame({1, 20}, 0), [](int, int y) { return (y / 2) % 2 == 0 ? 5 : -5; }));
  ASSERT_TRUE(rows);
  EXPECT_NEAR(rows->row_noise_dn, 5, 0.5);
  EXPECT_LT(rows->column_noise_dn, 0.9);
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(rows->rows[site].white_dn, 2 * std::sqrt(216.0 / 200), 0.05);
    EXPECT_NEAR(rows->rows[site].found_dn, std::hypot(5, rows->rows[site].white_dn), 0.6);
    EXPECT_GT(rows->level_dn[site].standard_error, 5 / std::sqrt(150.0));  // rows count, not pixels
  }
}

TEST(BlackFigures, KeepTheParityOfRowsApart) {
  const SensorBench bench{.sensor = dark_200(), .width = 256, .height = 256};
  const auto found = measure_black(moved(bench.frame({1, 20}, 0), [](int, int y) { return y % 2 == 0 ? 0 : 6; }));
  ASSERT_TRUE(found);
  const double odd = (found->level_dn[2].value + found->level_dn[3].value) / 2;
  const double even = (found->level_dn[0].value + found->level_dn[1].value) / 2;
  EXPECT_NEAR(odd - even, 6, 5 * 2 * std::sqrt(216.0 / 32768) * std::sqrt(2));
}

TEST(BlackFigures, LeaveHotPixelsOut) {
  const SensorBench bench{.sensor = dark_200(), .width = 256, .height = 256};
  const auto plain = measure_black(bench.frame({1, 20}, 0));
  const auto hot =
      measure_black(moved(bench.frame({1, 20}, 0), [](int x, int y) { return x % 31 == 3 && y % 17 == 5 ? 3000 : 0; }));
  ASSERT_TRUE(plain && hot);
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(hot->level_dn[site].value, plain->level_dn[site].value, plain->level_dn[site].standard_error);
  }
  EXPECT_GT(hot->excluded_fraction, 1.0 / (32 * 18));
}

TEST(BlackFigures, RefuseFramesThatAreNotDark) {
  const SensorBench bench{.sensor = dark_200(), .width = 128, .height = 128};
  const auto at_zero =
      measure_black(moved(bench.frame({1, 20}, 0), [](int x, int) { return x % 64 == 0 ? -9999 : 0; }));
  ASSERT_FALSE(at_zero);
  EXPECT_NE(at_zero.error().message.find("code 0"), std::string::npos);
  const auto at_white = measure_black(moved(bench.frame({1, 20}, 0), [](int, int) { return 9999; }));
  ASSERT_FALSE(at_white);
  EXPECT_NE(at_white.error().message.find("white level"), std::string::npos);
  const auto scattered =
      measure_black(moved(bench.frame({1, 20}, 0), [](int x, int) { return x % 9 == 0 ? 2000 : 0; }));
  ASSERT_FALSE(scattered);
  EXPECT_NE(scattered.error().message.find("% of the pixels are outliers"), std::string::npos);
  const SensorBench tiny{.sensor = dark_200(), .width = 40, .height = 40};
  const auto few = measure_black(tiny.frame({1, 20}, 0));
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message.find("400 dark pixels"), std::string::npos) << few.error().message;
}

TEST(PartOf, KeepsThePixelsAndTheirColours) {
  const SensorBench bench{.sensor = dark_200(), .width = 64, .height = 48, .phase = BayerPhase::gbrg};
  RawDn raw = bench.frame({1, 20}, 0);
  raw.active = {7, 5, 50, 40};
  const auto part = part_of(raw, {0, 6, 7, 30});  // columns -7.. of the active area: one is left out
  ASSERT_TRUE(part);
  EXPECT_EQ(part->active, (Rect{0, 0, 6, 29}));
  EXPECT_EQ(part->phase, BayerPhase::gbrg);
  for (int y = 0; y < 29; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(part->dn.at(x, y), raw.dn.at(x + 1, y + 7));
  }
  EXPECT_FALSE(part_of(raw, {60, 0, 10, 10}));
  EXPECT_FALSE(part_of(raw, {-3, 1, 10, 10}));
  EXPECT_FALSE(part_of(raw, {8, 5, 1, 10}));  // nothing is left of it
}

}  // namespace
}  // namespace lowlux::calib
