#include "isp/base/noise_ratio.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace lowlux {
namespace {

NoiseRatio random_ratio(int columns, int rows, int block_px, std::mt19937& random) {
  NoiseRatio out{.block_px = block_px, .ratio = Plane<float>(columns, rows)};
  std::uniform_real_distribution<float> between(0.1f, 2);
  for (std::size_t i = 0; i < out.ratio.size(); ++i) out.ratio.data()[i] = between(random);
  return out;
}

float ratio_of_pixel(const NoiseRatio& of, int x, int y) {
  const auto block = [&](int px, int blocks) {
    int found = 0;
    while (found + 1 < blocks && px >= (found + 1) * of.block_px) ++found;
    return found;
  };
  return of.ratio.at(block(x, of.ratio.width()), block(y, of.ratio.height()));
}

TEST(NoiseRatio, IsThatOfTheBlockOfEachPixelAtAnyStepAndOffset) {
  const unsigned seed = 20261124;
  std::mt19937 random(seed);
  const auto draw = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
  for (int round = 0; round < 200; ++round) {
    const NoiseRatio of = random_ratio(draw(1, 7), draw(1, 5), draw(1, 20), random);
    const int corner_x = draw(0, 30), corner_y = draw(0, 30);
    const NoiseRatioView view = view_of(&of).from(corner_x, corner_y);
    const int first = draw(-5, 9), step = draw(1, 25), y = draw(-5, 60);
    std::vector<float> row(static_cast<std::size_t>(draw(1, 40)));
    view.row(first, step, y, row);
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int x = first + static_cast<int>(i) * step;
      const float expected = ratio_of_pixel(of, corner_x + x, corner_y + y);
      ASSERT_EQ(row[i], expected) << "seed " << seed << ", round " << round;
      ASSERT_EQ(view.at(x, y), expected) << "seed " << seed << ", round " << round;
    }
    const int width = draw(1, 50), height = draw(1, 50);
    double sum = 0;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        sum += static_cast<double>(ratio_of_pixel(of, corner_x + first + i, corner_y + y + j));
      }
    }
    // Sums of up to 2500 doubles, in another order.
    ASSERT_NEAR(view.mean(first, y, width, height), sum / (width * height), 1e-12) << "seed " << seed << ", " << round;
  }
}

TEST(NoiseRatio, IsOneWithoutBlocks) {
  const NoiseRatioView none = view_of(nullptr);
  EXPECT_TRUE(none.is_one());
  EXPECT_EQ(none.from(3, 4).at(7, 100), 1);
  EXPECT_EQ(none.mean(0, 0, 5, 5), 1);
  EXPECT_EQ(median_ratio(nullptr), 1);
}

TEST(NoiseRatio, HasTheMedianOfItsBlocks) {
  NoiseRatio of{.ratio = Plane<float>(3, 2)};
  const std::vector<float> values{0.5f, 3, 1, 0.25f, 2, 0.125f};
  std::copy(values.begin(), values.end(), of.ratio.data());
  EXPECT_EQ(median_ratio(&of), 1);  // the larger of 0.5 and 1
}

TEST(NoiseRatio, CoversAFrameWithWholeBlocks) {
  EXPECT_EQ(ratio_blocks(16, 8), 2);
  EXPECT_EQ(ratio_blocks(17, 8), 3);
  EXPECT_EQ(ratio_blocks(1, 8), 1);
}

}  // namespace
}  // namespace lowlux
