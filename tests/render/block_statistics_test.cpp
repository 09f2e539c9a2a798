#include "isp/render/block_statistics.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace lowlux::isp {
namespace {

TEST(Quantile, IsTheValueAtTheRankRoundedDown) {
  const std::vector<float> values{5, 1, 4, 2, 3};
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 0.5), 3);
  EXPECT_EQ(quantile(values, 0.74), 3);  // 0.74 * 4 = 2.96
  EXPECT_EQ(quantile(values, 0.75), 4);
  EXPECT_EQ(quantile(values, 1), 5);
}

TEST(Quantile, LeavesOutWhatIsNotFiniteAndIsNothingOfNothing) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(quantile(std::vector<float>{nan, 2, infinity, 1, -infinity}, 1), 2);
  EXPECT_FALSE(quantile(std::vector<float>{nan, infinity}, 0.5));
  EXPECT_FALSE(quantile({}, 0.5));
}

TEST(BlackScatter, IsTheDepthBelowZeroAndNothingAbove) {
  EXPECT_DOUBLE_EQ(black_scatter(std::vector<float>{-0.25f, 0, 0.25f}), 0.25);
  EXPECT_EQ(black_scatter(std::vector<float>{0.1f, 0.2f}), 0);
  EXPECT_EQ(black_scatter({}), 0);
}

TEST(BlockLuminance, WeighsTheChannelsRowByRowThroughTheStride) {
  CameraRgb planes(3, 2);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 3; ++x) planes.plane[c].at(x, y) = static_cast<float>(100 * c + 10 * y + x);
    }
  }
  const CameraRgb& read = planes;
  RgbView<const float> cropped;
  for (int c = 0; c < 3; ++c) cropped[c] = read.plane[c].view().crop(1, 0, 2, 2);
  EXPECT_EQ(block_luminance(cropped, {1, 0.5, 0.25}), (std::vector<float>{101.75f, 103.5f, 119.25f, 121}));
  std::vector<float> values{3, NAN, 1, 2, INFINITY};
  EXPECT_EQ(quantile_reordering(values, 1), 3);
  EXPECT_EQ(quantile_reordering(values, 0.5), 2);
}

}  // namespace
}  // namespace lowlux::isp
