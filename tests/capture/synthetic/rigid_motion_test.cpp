#include "capture/synthetic/rigid_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lowlux::capture {
namespace {

constexpr double tolerance_px = 1e-9;  // doubles at positions of some thousand pixels

void expect_near(ImagePoint a, ImagePoint b) {
  EXPECT_NEAR(a.x_px, b.x_px, tolerance_px);
  EXPECT_NEAR(a.y_px, b.y_px, tolerance_px);
}

TEST(RigidMotion, ADisplacementWithoutRotationIsExact) {
  const RigidMotion motion = rigid_motion({1e5, -3.3}, 0, 0.25, -7.5);
  for (const ImagePoint p : {ImagePoint{0, 0}, {1234, 999}, {-3, 17}}) {
    EXPECT_EQ(motion.at(p).x_px, p.x_px + 0.25);
    EXPECT_EQ(motion.at(p).y_px, p.y_px - 7.5);
  }
  EXPECT_EQ(motion.rotation_deg(), 0);
}

TEST(RigidMotion, AQuarterTurnTakesRightToDown) {
  const RigidMotion motion = rigid_motion({10, 20}, 90, 1, 2);
  expect_near(motion.at({13, 20}), {11, 25});  // 3 right of the centre becomes 3 below it
  expect_near(motion.at({10, 20}), {11, 22});
  EXPECT_NEAR(motion.rotation_deg(), 90, 1e-12);
}

TEST(RigidMotion, InversesAndCombinationsAreThoseOfTheFunctions) {
  constexpr unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3000, 3000), angle(-180, 180);
  for (int i = 0; i < 200; ++i) {
    const RigidMotion a = rigid_motion({place(random), place(random)}, angle(random), place(random), place(random));
    const RigidMotion b = rigid_motion({place(random), place(random)}, angle(random), place(random), place(random));
    const ImagePoint p{place(random), place(random)};
    expect_near(inverse(a).at(a.at(p)), p);
    expect_near(combined(a, b).at(p), b.at(a.at(p)));
    EXPECT_NEAR(std::hypot(a.cosine, a.sine), 1, 1e-15);
  }
}

TEST(RigidMotion, BoundsHoldTheCornersAndTouchThem) {
  const ImageBox box = bounds_of(rigid_motion({0, 0}, 45, 0, 0), {-1, -1, 1, 1});
  const double reach = std::sqrt(2.0);
  EXPECT_NEAR(box.left_px, -reach, 1e-12);
  EXPECT_NEAR(box.top_px, -reach, 1e-12);
  EXPECT_NEAR(box.right_px, reach, 1e-12);
  EXPECT_NEAR(box.bottom_px, reach, 1e-12);
}

}  // namespace
}  // namespace lowlux::capture
