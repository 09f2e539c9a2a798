#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "tests/capture/synthetic/burst_scene.h"

namespace lowlux::capture {
namespace {

using test::burst_of;
using test::PlaneMoments;

constexpr int side = 160;

// One star-like light on a dark scene, and everything that moves but objects.
BurstSource one_point(double x_px, double y_px, std::uint64_t seed) {
  Scene scene = *dark_scene(test::setup_of(2 * side, 2 * side, 1));
  EXPECT_TRUE(add_lamp(scene, x_px, y_px, *isp::light_named("A"), 5));
  BurstOptions burst;
  burst.reduction = 2;
  burst.shake_px = 20, burst.roll_deg = 1.5, burst.dither_px = 1, burst.field_rotation_deg = 2;
  burst.drift_x_px = 0.37, burst.drift_y_px = -0.21;
  burst.field_centre = ImagePoint{200, 70};
  return burst_of(std::move(scene), burst, {.exposure = {0.5, 20}, .seed = seed});
}

TEST(BurstPoints, ALightIsWhereTheMotionStatesWithItsFluxAndItsWidth) {
  InlineExecutor executor;
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0.4 * side, 0.6 * side);
  for (int draw = 0; draw < 4; ++draw) {
    const ImagePoint start{place(random), place(random)};
    const BurstSource source = one_point(start.x_px, start.y_px, random());
    const PlaneMoments first = test::moments_of(source.signal_e(0, executor).plane[0]);
    EXPECT_NEAR(first.x, start.x_px, 1e-3);
    EXPECT_NEAR(first.y, start.y_px, 1e-3);
    for (std::uint32_t i = 1; i < 8; ++i) {
      const CameraRgb signal = source.signal_e(i, executor);
      const PlaneMoments m = test::moments_of(signal.plane[0]);
      const ImagePoint expected = source.truth(i).motion.at(start);
      EXPECT_NEAR(m.x, expected.x_px, 1e-3) << i;
      EXPECT_NEAR(m.y, expected.y_px, 1e-3) << i;
      EXPECT_NEAR(m.sum / first.sum, 1, 1e-6) << "float sums";
      EXPECT_NEAR(m.xx, 0.7 * 0.7 + 1.0 / 12, 2e-3) << "Gaussian and pixel; aliasing below it";
      EXPECT_NEAR(m.yy, 0.7 * 0.7 + 1.0 / 12, 2e-3);
      const std::vector<BurstPoint> points = source.points(i);
      ASSERT_EQ(points.size(), 1U);
      EXPECT_NEAR(points[0].place.x_px, expected.x_px, 1e-9);
      EXPECT_NEAR(points[0].place.y_px, expected.y_px, 1e-9);
      EXPECT_NEAR(points[0].signal_e[0] / m.sum, 1, 1e-6);
      EXPECT_EQ(points[0].spread_px, 0.7);
    }
  }
}

Scene stars(int count, int width = side, int height = side) {
  Scene scene = *dark_scene(test::setup_of(width, height, 1));
  EXPECT_TRUE(add_stars(scene, count, 0.01, 11));
  return scene;
}

int inside(const std::vector<BurstPoint>& points) {
  return static_cast<int>(std::count_if(points.begin(), points.end(), [](const BurstPoint& p) {
    return p.place.x_px >= -0.5 && p.place.x_px < side - 0.5 && p.place.y_px >= -0.5 && p.place.y_px < side - 0.5;
  }));
}

// Uniform stars: the number in a frame is binomial about that of a cell, at most of variance `count`.
TEST(BurstPoints, StarsEnterWhereTheFieldMoves) {
  constexpr int count = 400;
  BurstOptions burst;
  burst.reduction = 1;
  burst.field_rotation_deg = 5, burst.drift_x_px = 12;
  const BurstSource source = burst_of(stars(count), burst);
  EXPECT_EQ(inside(source.points(0)), count);
  for (const std::uint32_t i : {1U, 5U, 13U, 40U}) {
    EXPECT_NEAR(inside(source.points(i)), count, 5 * std::sqrt(count)) << i;
  }
  // Those of frame 0 that are still there are where the motion takes them, with the light they had.
  const std::vector<BurstPoint> first = source.points(0), later = source.points(3);
  int found = 0;
  for (const BurstPoint& p : first) {
    const ImagePoint expected = source.truth(3).motion.at(p.place);
    found += std::ranges::any_of(later, [&](const BurstPoint& q) {
      return std::hypot(q.place.x_px - expected.x_px, q.place.y_px - expected.y_px) < 1e-9 && q.signal_e == p.signal_e;
    });
  }
  EXPECT_GT(found, count / 2);
}

TEST(BurstPoints, TheFirstFrameOfAStarFieldIsTheSingleFrame) {
  InlineExecutor executor;
  Scene scene = *dark_scene(test::setup_of(2 * side, 2 * side, 1));
  ASSERT_TRUE(add_stars(scene, 100, 0.01, 11, 2));
  BurstOptions burst;
  burst.reduction = 2, burst.field_rotation_deg = 1;
  const CameraRgb frame = burst_of(std::move(scene), burst).signal_e(0, executor);
  const auto single = test::source_of(stars(100), test::plain_sensor());
  ASSERT_TRUE(single);
  const CameraRgb expected = single->signal_e(executor);
  // Only stars of the cells around it, whose light reaches over the edges, are more.
  for (int y = 8; y < side - 8; ++y) {
    for (int x = 8; x < side - 8; ++x) EXPECT_EQ(frame.plane[1].at(x, y), expected.plane[1].at(x, y));
  }
}

TEST(BurstPoints, TheForegroundHidesStarsAndKeepsItsLamps) {
  Scene scene = stars(600);
  ASSERT_TRUE(add_lamp(scene, 30, 120, *isp::light_named("A"), 1));
  BurstOptions burst;
  burst.reduction = 1;
  burst.horizon_px = 100, burst.drift_y_px = 3;
  const BurstSource source = burst_of(std::move(scene), burst);
  for (const std::uint32_t i : {0U, 4U}) {
    int lamps = 0;
    for (const BurstPoint& p : source.points(i)) {
      const bool is_lamp = p.place.x_px == 30 && p.place.y_px == 120;
      lamps += is_lamp;
      EXPECT_TRUE(is_lamp || p.place.y_px < 99.5);
    }
    EXPECT_EQ(lamps, 1) << i;
  }
  // 3 px per frame downwards: those within 12 px above the horizon have set by frame 4.
  int set = 0;
  for (const BurstPoint& p : source.points(0)) set += p.place.y_px >= 87.5 && p.place.y_px < 99.5;
  EXPECT_GT(set, 0);
}

TEST(BurstPoints, ObjectsHideTheLightsBehindThem) {
  BurstOptions burst;
  burst.reduction = 2, burst.movers = 2, burst.mover_size_px = 60;
  Scene scene = *flat_scene(test::setup_of(2 * side, 2 * side, 1));
  ASSERT_TRUE(add_stars(scene, 500, 0.01, 3, 2));
  const BurstSource source = burst_of(std::move(scene), burst);
  for (const std::uint32_t i : {0U, 3U}) {
    for (const BurstPoint& p : source.points(i)) {
      for (const ImageBox& box : source.truth(i).movers) {
        EXPECT_FALSE(p.place.x_px >= box.left_px && p.place.x_px < box.right_px && p.place.y_px >= box.top_px &&
                     p.place.y_px < box.bottom_px);
      }
    }
    EXPECT_LT(inside(source.points(i)), 500);
  }
}

}  // namespace
}  // namespace lowlux::capture
