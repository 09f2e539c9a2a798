// The integer kernels of motion compensation against plain loops; frame_motion_test compares instruction sets.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "denoise/temporal/motion_rows.h"
#include "tests/denoise/frames.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
namespace rows = denoise::rows;

/// Columns and rows of cells that kernels may read.
Plane<std::int16_t> random_cells(int width, int height, std::mt19937& random) {
  Plane<std::int16_t> out(width, height);
  const std::array scale{3, 100, 8191};
  std::uniform_int_distribution<int> value(0, scale[random() % 3]);
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = static_cast<std::int16_t>(value(random));
  return out;
}

std::int64_t plain_difference(const rows::CellPair& at, int width, int height) {
  std::int64_t sum = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int d = std::clamp(at.frame[y * at.frame_stride + x] - at.mean[y * at.mean_stride + x], -64, 64);
      sum += static_cast<std::int64_t>(d) * d;
    }
  }
  return sum;
}

TEST(MotionRows, SumSquaredDifferencesOfAnySize) {
  std::mt19937 random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const int width = 1 + static_cast<int>(random() % 90), height = 1 + static_cast<int>(random() % 40);
    const auto a = random_cells(width, height, random), b = random_cells(width + 7, height, random);
    const rows::CellPair at{a.data(), a.width(), b.data(), b.width()};
    ASSERT_EQ(rows::squared_difference(at, width, height), plain_difference(at, width, height)) << width;
  }
}

// The largest difference everywhere: sums of more than 32 bits.
TEST(MotionRows, SumDifferencesOfWholeFrames) {
  Plane<std::int16_t> low(4099, 1501), high(4099, 1501);
  std::fill_n(low.data(), low.size(), std::int16_t{0});
  std::fill_n(high.data(), high.size(), std::int16_t{8191});
  const std::int64_t expected = static_cast<std::int64_t>(low.size()) * 64 * 64;
  const rows::CellPair at{high.data(), high.width(), low.data(), low.width()};
  EXPECT_EQ(rows::squared_difference(at, low.width(), low.height()), expected);
}

TEST(MotionRows, SumProductsOfSlopes) {
  std::mt19937 random(2);
  for (int draw = 0; draw < 100; ++draw) {
    const int blocks = 1 + draw % 4;
    const auto frame = random_cells(40, 6, random), mean = random_cells(50, 6, random);
    const rows::CellPair at{frame.row(1) + 1, frame.width(), mean.row(1) + 1, mean.width()};
    std::array<rows::BlockSlopes, 4> got{};
    rows::block_slopes(at, blocks, got.data());
    for (int block = 0; block < blocks; ++block) {
      std::array<long long, 5> sum{};
      for (int y = 1; y < 5; ++y) {
        for (int x = 4 * block + 1; x < 4 * block + 5; ++x) {
          const auto limited = [](int v) { return std::clamp(v, -2047, 2047); };
          const int gx = limited(mean.at(x + 1, y) - mean.at(x - 1, y)),
                    gy = limited(mean.at(x, y + 1) - mean.at(x, y - 1)), d = limited(frame.at(x, y) - mean.at(x, y));
          const std::array product{gx * gx, gx * gy, gy * gy, gx * d, gy * d};
          for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += product[k];
        }
      }
      const std::array<long long, 5> of{got[block].xx, got[block].xy, got[block].yy, got[block].xd, got[block].yd};
      ASSERT_EQ(of, sum);
    }
  }
}

// The noise of stabilised cells has the standard deviation units_per_sigma in all lights. Rounding adds 1 / 12; the
// standard error of a deviation is 1 / sqrt(2 n). Below some electrons a square root is not linear over the noise.
TEST(MotionRows, StabiliseNoise) {
  constexpr int cells = 100'001;
  const Camera camera{.dark_e = {1, 1, 1, 1}, .read_noise_e = 2};
  for (const double e : {4.0, 40.0, 1000.0, 30000.0}) {
    const auto raw = exposed(camera, flat(e, e, e), 2 * cells, 2, 3);
    std::vector<std::int16_t> out(cells);
    rows::stabilise_row({raw.row(0), raw.row(1), cells, {1, 1, 1, 1}, 4 * (1 + 4)}, out.data());
    double sum = 0, squares = 0;
    for (const std::int16_t v : out) sum += v, squares += static_cast<double>(v) * v;
    const double deviation = std::sqrt(squares / cells - std::pow(sum / cells, 2));
    EXPECT_NEAR(sum / cells, 8 * std::sqrt(4 * (e + 5)), 0.6) << e;
    EXPECT_NEAR(deviation, std::sqrt(16 + 1.0 / 12), e < 10 ? 0.12 : 5 * 4 / std::sqrt(2.0 * cells) + 0.02) << e;
  }
}

TEST(MotionRows, StabiliseAnyNumber) {
  constexpr float infinite = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const std::array upper{nan, nan, infinite, infinite, -infinite, -1.0f, 3e38f, 3e38f, 1e-40f, 0.0f};
  const std::array lower{nan, nan, infinite, infinite, -infinite, -1.0f, 3e38f, 3e38f, -1e-40f, 0.0f};
  std::array<std::int16_t, 5> out{};
  rows::stabilise_row({upper.data(), lower.data(), 5, {}, 4}, out.data());
  EXPECT_EQ(out, (std::array<std::int16_t, 5>{16, 8191, 0, 8191, 16}));
}

}  // namespace
}  // namespace lowlux
