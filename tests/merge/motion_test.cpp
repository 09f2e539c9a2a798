#include "isp/merge/motion.h"

#include <gtest/gtest.h>

namespace lowlux::merge {
namespace {

TEST(Motion, InterpolatesALinearFieldExactlyUpToTheFarEdges) {
  for (const int width : {1, 2, 33, 64, 65, 97}) {
    Motion motion = no_motion(width, 70);
    for (int j = 0; j < motion.dx_px.height(); ++j) {
      for (int i = 0; i < motion.dx_px.width(); ++i) {
        motion.dx_px.at(i, j) = static_cast<float>(1.5 + 0.25 * i - 0.5 * j);
        motion.dy_px.at(i, j) = static_cast<float>(-2 + 0.125 * i + 1.0 * j);
      }
    }
    for (int y = 0; y < 70; ++y) {
      for (int x = 0; x < width; ++x) {
        const Shift shift = motion.at(static_cast<float>(x), static_cast<float>(y));
        EXPECT_NEAR(shift.dx_px, 1.5 + 0.25 * x / 32 - 0.5 * y / 32, 1e-5) << width;
        EXPECT_NEAR(shift.dy_px, -2 + 0.125 * x / 32 + 1.0 * y / 32, 1e-5) << width;
      }
    }
  }
}

TEST(Motion, NoMotionMovesNothing) {
  const Motion motion = no_motion(5000, 3000);
  EXPECT_EQ(motion.at(4999, 2999).dx_px, 0);
  EXPECT_EQ(motion.at(0, 0).dy_px, 0);
}

}  // namespace
}  // namespace lowlux::merge
