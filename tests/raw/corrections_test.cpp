#include "isp/raw/corrections.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lowlux::isp {
namespace {

InlineExecutor executor;

Plane<float> ones(int width, int height) {
  Plane<float> plane(width, height);
  std::fill_n(plane.data(), plane.size(), 1.0f);
  return plane;
}

// A 2x2 map whose points lie on the corners of the area.
GainMap corner_map(int size, std::vector<float> gain) {
  GainMap map;
  map.bottom = map.right = size;
  map.points_v = map.points_h = 2;
  map.gain = std::move(gain);
  return map;
}

TEST(GainMap, IsBilinearBetweenItsPoints) {
  Plane<float> plane = ones(10, 10);
  apply_gains({.gain_maps = {corner_map(10, {1, 2, 3, 4})}, .radial_gains = {}, .defects = {}}, plane.view(), executor);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) EXPECT_NEAR(plane.at(x, y), 1 + (x + 0.5) / 10 + 2 * (y + 0.5) / 10, 1e-6);
  }
}

TEST(GainMap, PitchAndAreaChooseOneCfaSite) {
  GainMap map = corner_map(9, {2, 2, 2, 2});
  map.top = 1;
  map.left = 2;
  map.row_pitch = map.column_pitch = 2;
  for (const int threads : {1, 3}) {
    Plane<float> plane = ones(12, 12);
    PoolExecutor pool(threads);
    apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), pool);
    for (int y = 0; y < 12; ++y) {
      for (int x = 0; x < 12; ++x) {
        const bool inside = y >= 1 && y < 9 && x >= 2 && x < 9;
        EXPECT_EQ(plane.at(x, y), inside && y % 2 == 1 && x % 2 == 0 ? 2.0f : 1.0f);
      }
    }
  }
}

TEST(GainMap, OutsideItsPointsItKeepsTheNearest) {
  GainMap map = corner_map(8, {1, 5, 1, 5});
  map.origin_h = 0.5;
  map.spacing_h = 0.25;
  Plane<float> plane = ones(8, 8);
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), executor);
  EXPECT_FLOAT_EQ(plane.at(0, 3), 1);
  EXPECT_FLOAT_EQ(plane.at(7, 3), 5);
}

TEST(GainMap, ASinglePointIsOneGainAndNegativeValuesStayNegative) {
  GainMap map;
  map.bottom = map.right = 4;
  map.gain = {1.5f};
  Plane<float> plane = ones(4, 4);
  plane.at(1, 1) = -2;
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), executor);
  EXPECT_FLOAT_EQ(plane.at(1, 1), -3);
  EXPECT_FLOAT_EQ(plane.at(3, 0), 1.5);
}

TEST(GainMap, PlanesOfRgbAreChosenByTheMap) {
  GainMap map = corner_map(4, {2, 2, 2, 2});
  map.first_plane = 1;
  map.planes = 2;
  Plane<float> r = ones(4, 4), g = ones(4, 4), b = ones(4, 4);
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, {r.view(), g.view(), b.view()}, executor);
  EXPECT_EQ(r.at(2, 2), 1);
  EXPECT_EQ(g.at(2, 2), 2);
  EXPECT_EQ(b.at(2, 2), 2);
}

TEST(RadialGain, IsOneAtTheCentreAndTheSumOfItsTermsInTheFarthestCorner) {
  RadialGain gain{.k = {0.1, 0.2, 0.3, 0.4, 0.5}, .centre_x = 0.25, .centre_y = 0.25};
  Plane<float> plane = ones(9, 9);
  apply_gains({.gain_maps = {}, .radial_gains = {gain}, .defects = {}}, plane.view(), executor);
  EXPECT_FLOAT_EQ(plane.at(2, 2), 1);
  EXPECT_FLOAT_EQ(plane.at(8, 8), 2.5);
  const double r2 = 0.5;  // (8, 2) is at distance 6 of 6 sqrt(2)
  EXPECT_NEAR(plane.at(8, 2),
              1 + 0.1 * r2 + 0.2 * r2 * r2 + 0.3 * std::pow(r2, 3) + 0.4 * std::pow(r2, 4) + 0.5 * std::pow(r2, 5),
              1e-6);
}

TEST(GainMap, AllOnesHasNoEffect) {
  EXPECT_FALSE(has_effect(corner_map(4, {1, 1, 1, 1})));
  EXPECT_TRUE(has_effect(corner_map(4, {1, 1, 1, 1.01f})));
}

}  // namespace
}  // namespace lowlux::isp
