#include "calib/sheet/pattern_plots.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace lowlux::calib {
namespace {

constexpr std::uint64_t first_seed = 20261129;

TEST(PatternPlots, AWaveHasItsPowerAtItsFrequencyAndNoiseEverywhere) {
  constexpr int width = 300, height = 64, cycles = 16;  // in 256 pixels
  std::mt19937_64 random(first_seed);
  std::normal_distribution<double> noise(0, 2);
  Plane<float> wave(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      wave.at(x, y) = static_cast<float>(5 * std::sin(2 * std::numbers::pi * cycles * x / 256.0) + noise(random));
    }
  }
  const auto rows = spectrogram(wave, Direction::along_rows), columns = spectrogram(wave, Direction::along_columns);
  ASSERT_EQ(rows.size(), 129u);
  ASSERT_EQ(columns.size(), 33u);
  // A sine of amplitude a has the power a^2 n / 4; noise of variance s^2 that of s^2, by 64 rows within s^2 / 8.
  EXPECT_NEAR(rows[cycles] * rows[cycles], 25 * 256 / 4.0 + 4, 5 * 2 * std::sqrt(25 * 256 / 4.0 * 4 / 2 / height));
  for (std::size_t k = 1; k + 1 < rows.size(); ++k) {
    if (k == cycles) continue;
    EXPECT_NEAR(rows[k] * rows[k], 4, 5 * 4 / std::sqrt(static_cast<double>(height))) << k;
  }
  for (std::size_t k = 1; k + 1 < columns.size(); ++k) {
    EXPECT_NEAR(columns[k] * columns[k], 4, 5 * 4 / std::sqrt(300.0)) << k;
  }
}

TEST(PatternPlots, AHistogramHasEveryPixel) {
  Plane<float> values(4, 2);
  const float of[] = {-1, -1, 0, 0.5F, 1, 2, 3, 3};
  std::copy_n(of, 8, values.data());
  const Histogram histogram = histogram_of(values, 4);
  EXPECT_EQ(histogram.count, (std::vector<double>{2, 2, 1, 3}));
  EXPECT_EQ(histogram.centre, (std::vector<double>{-0.5, 0.5, 1.5, 2.5}));
  std::fill_n(values.data(), 8, 7.0F);
  EXPECT_EQ(histogram_of(values, 2).count, (std::vector<double>{8, 0}));
}

}  // namespace
}  // namespace lowlux::calib
