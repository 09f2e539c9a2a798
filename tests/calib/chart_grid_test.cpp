#include "calib/chart/chart_grid.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "tests/calib/chart_frame.h"

namespace lowlux::calib {
namespace {

constexpr std::array<PicturePoint, 4> slanted{{{10, 20}, {110, 30}, {100, 90}, {5, 80}}};

TEST(GridOf, TakesThePlanesCornersToThePoints) {
  const auto grid = grid_of(slanted);
  ASSERT_TRUE(grid);
  const std::array<PicturePoint, 4> plane{{{0, 0}, {6, 0}, {6, 4}, {0, 4}}};
  for (int i = 0; i < 4; ++i) {
    const PicturePoint at = grid->at(plane[i].x, plane[i].y);
    EXPECT_NEAR(at.x, slanted[i].x, 1e-9);  // px: doubles
    EXPECT_NEAR(at.y, slanted[i].y, 1e-9);
  }
}

TEST(GridOf, TurnsAboutTheMiddleAndMirrors) {
  ChartGrid grid = *grid_of(slanted);
  const PicturePoint corner = grid.at(0, 0), across = grid.at(6, 0), below = grid.at(0, 4);
  grid.turn = ChartTurn::half_turn;
  EXPECT_NEAR(grid.at(6, 4).x, corner.x, 1e-9);
  grid.turn = ChartTurn::mirrored_columns;
  EXPECT_NEAR(grid.at(0, 0).x, across.x, 1e-9);
  grid.turn = ChartTurn::mirrored_rows;
  EXPECT_NEAR(grid.at(0, 0).y, below.y, 1e-9);
}

TEST(GridOf, RefusesWhatIsNoConvexQuadrilateral) {
  EXPECT_FALSE(grid_of({{{0, 0}, {10, 0}, {20, 0}, {0, 10}}}));   // three on a line
  EXPECT_FALSE(grid_of({{{0, 0}, {10, 10}, {10, 0}, {0, 10}}}));  // crossed
  EXPECT_FALSE(grid_of({{{0, 0}, {10, 0}, {2, 2}, {0, 10}}}));    // a dart
  EXPECT_FALSE(grid_of({}));
  EXPECT_FALSE(grid_of({{{0, 0}, {std::numeric_limits<double>::infinity(), 0}, {10, 10}, {0, 10}}}));
  EXPECT_TRUE(grid_of({{{0, 0}, {0, 10}, {10, 10}, {10, 0}}}));  // the other way round: a mirror
}

TEST(Rescaled, MovesEveryPoint) {
  const ChartGrid grid = *grid_of(slanted), larger = rescaled(grid, 3, 1);
  const PicturePoint at = grid.at(2.5, 1.5), there = larger.at(2.5, 1.5);
  EXPECT_NEAR(there.x, 3 * at.x + 1, 1e-9);
  EXPECT_NEAR(there.y, 3 * at.y + 1, 1e-9);
}

TEST(Refined, FindsItsWayFromAFifthOfACellOff) {
  const test::ChartPhotograph photograph{.angle_deg = 8, .keystone = 0.05};
  const ChartPicture picture = test::photographed(photograph);
  std::array<PicturePoint, 4> start{test::half_size_point(photograph, 0, 0), test::half_size_point(photograph, 6, 0),
                                    test::half_size_point(photograph, 6, 4), test::half_size_point(photograph, 0, 4)};
  const double cell_px = photograph.cell_px / 2;
  start[0].x += 0.2 * cell_px;
  start[1].y -= 0.15 * cell_px;
  start[2].x += 0.1 * cell_px;
  const auto grid = refined(*grid_of(start), picture.rgb.view());
  ASSERT_TRUE(grid);
  for (const auto& [u, v] : {std::array{0, 0}, {6, 0}, {6, 4}, {0, 4}}) {
    const PicturePoint at = grid->at(u, v), expected = test::half_size_point(photograph, u, v);
    // Patches fill 0.86 of a cell and 0.76 is looked at, so that 0.05 either way look alike; at a corner, half a cell
    // beyond the outer patches' middles, that is 0.06 and 0.067, and the last step is 0.0125 each way.
    EXPECT_LE(std::hypot(at.x - expected.x, at.y - expected.y), 0.11 * cell_px) << u << " " << v;
  }
}

TEST(Refined, RefusesAGridThatLeavesThePicture) {
  const CameraRgb picture(50, 50);
  EXPECT_FALSE(refined(*grid_of(slanted), picture.view()));
}

}  // namespace
}  // namespace lowlux::calib
