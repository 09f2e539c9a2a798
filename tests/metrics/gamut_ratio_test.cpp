#include "isp/metrics/gamut_ratio.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "isp/metrics/convex_hull.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

using Points = std::vector<Xy>;

double percent(const Points& reference, const Points& test) {
  const Points first = convex_hull(reference), second = convex_hull(test);
  return 100 * shared_area(first, second) / polygon_area(first);
}

const Points square{{-20, -20}, {20, -20}, {20, 20}, {-20, 20}};

TEST(ConvexHull, HasItsCheckValues) {
  EXPECT_NEAR(percent(square, {{0, 0}, {30, 0}, {30, 10}, {0, 10}}), 12.5, 1e-11);
  Points disc;
  for (int degrees = 0; degrees < 360; ++degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    disc.push_back({10 * std::cos(angle), 10 * std::sin(angle)});
  }
  const double triangles = 360 * 0.5 * 100 * std::sin(std::numbers::pi / 180);
  EXPECT_NEAR(percent(square, disc), 100 * triangles / 1600, 1e-11);
  EXPECT_NEAR(percent(disc, square), 100, 1e-11);
}

TEST(ConvexHull, OrderPlaceAndInnerPointsDoNotMatter) {
  const Points test{{0, 0}, {30, 0}, {30, 10}, {0, 10}};
  Points shuffled{{5, 5}, {30, 10}, {0, 0}, {0, 10}, {30, 0}, {30, 5}, {0, 0}};
  EXPECT_NEAR(percent(square, shuffled), 12.5, 1e-11);
  std::ranges::reverse(shuffled);
  EXPECT_NEAR(percent(square, shuffled), 12.5, 1e-11);
  const auto moved = [](Points points) {
    for (Xy& p : points) p = {p.x + 100.5, p.y - 37};
    return points;
  };
  EXPECT_NEAR(percent(moved(square), moved(test)), 12.5, 1e-11);
}

TEST(ConvexHull, DegenerateHullsHaveNoArea) {
  const Points none, one{{1, 2}}, line{{0, 0}, {5, 5}, {10, 10}, {2, 2}};
  for (const Points& flat : {none, one, line}) {
    EXPECT_EQ(percent(square, flat), 0);
    EXPECT_TRUE(std::isnan(percent(flat, square)));
    EXPECT_TRUE(std::isnan(percent(flat, flat)));
    EXPECT_EQ(hull_area(flat), 0);
  }
  EXPECT_EQ(percent(square, {{30, 30}, {40, 30}, {40, 40}}), 0) << "they do not meet";
  EXPECT_EQ(percent(square, {{20, -20}, {40, -20}, {40, 20}, {20, 20}}), 0) << "they share an edge alone";
}

/// Whether a point lies in the convex hull of others: on the left of all edges of a hull whose corners are found by
/// brute force, as the pairs of points that have all others on one side.
bool is_in_hull(const Points& points, const Xy& place) {
  for (const Xy& p : points) {
    for (const Xy& q : points) {
      const auto side = [&](const Xy& o) { return (q.x - p.x) * (o.y - p.y) - (q.y - p.y) * (o.x - p.x); };
      if ((p.x != q.x || p.y != q.y) && std::ranges::all_of(points, [&](const Xy& o) { return side(o) >= 0; }) &&
          side(place) < 0) {
        return false;
      }
    }
  }
  return true;
}

TEST(ConvexHull, AreasOfDrawnPointsAreThoseOfCountingAFineGrid) {
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i) {
    std::uniform_real_distribution<double> any(-10, 10);
    const auto drawn = [&](int count) {
      Points out;
      for (int k = 0; k < count; ++k) out.push_back({any(random), any(random)});
      return out;
    };
    const Points first = drawn(3 + i % 6), second = i % 10 == 0 ? first : drawn(3 + i % 5);
    const int side = 160;
    const double cell = 20.0 / side;
    int in_first = 0, in_second = 0, in_both = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const Xy place{-10 + (x + 0.5) * cell, -10 + (y + 0.5) * cell};
        const bool a = is_in_hull(first, place), b = is_in_hull(second, place);
        in_first += a ? 1 : 0;
        in_second += b ? 1 : 0;
        in_both += a && b ? 1 : 0;
      }
    }
    // A convex outline within the square is at most 80 long; each cell it crosses is off by at most half: far below
    // 80 x cell / 2 in all.
    const double bound = 80 * cell / 2;
    EXPECT_NEAR(hull_area(first), in_first * cell * cell, bound) << i;
    EXPECT_NEAR(hull_area(second), in_second * cell * cell, bound) << i;
    EXPECT_NEAR(shared_area(convex_hull(first), convex_hull(second)), in_both * cell * cell, bound) << i;
    EXPECT_NEAR(shared_area(convex_hull(first), convex_hull(second)),
                shared_area(convex_hull(second), convex_hull(first)), 1e-11)
        << i;
  }
}

/// `count` pixels in each bin of a rectangle.
std::vector<Lab> filled(int a0, int b0, int columns, int rows, int count) {
  std::vector<Lab> out;
  for (int i = 0; i < columns * rows * count; ++i) {
    const int bin = i / count;
    out.push_back({50, a0 + bin % columns + 0.3, b0 + bin / columns + 0.8});
  }
  return out;
}

std::vector<Lab> joined(std::vector<Lab> first, const std::vector<Lab>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

TEST(GamutRatio, OfRectanglesOfBinsIsThatOfTheirCentres) {
  const std::vector<Lab> reference = filled(-20, -20, 41, 41, 3), test = filled(0, 0, 31, 11, 4);
  const GamutRatio found = gamut_ratio(reference, test);
  EXPECT_NEAR(found.convex_percent, 12.5, 1e-11);  // 20 x 10 of 40 x 40 between centres
  EXPECT_EQ(found.reference_bins, 41U * 41);
  EXPECT_EQ(found.test_bins, 31U * 11);
  EXPECT_DOUBLE_EQ(found.occupancy_percent, 100 * 21.0 * 11 / (41 * 41));
  const GamutRatio same = gamut_ratio(reference, reference);
  EXPECT_NEAR(same.convex_percent, 100, 1e-11);
  EXPECT_EQ(same.occupancy_percent, 100);
}

TEST(GamutRatio, OccupancySeesTheHoleThatTheHullCovers) {
  const std::vector<Lab> reference = filled(-10, -10, 21, 21, 3);
  const std::vector<Lab> corners = joined(joined(filled(-10, -10, 1, 1, 3), filled(10, -10, 1, 1, 3)),
                                          joined(filled(-10, 10, 1, 1, 3), filled(10, 10, 1, 1, 3)));
  const GamutRatio found = gamut_ratio(reference, corners);
  EXPECT_NEAR(found.convex_percent, 100, 1e-11);
  EXPECT_DOUBLE_EQ(found.occupancy_percent, 100 * 4.0 / (21 * 21));
}

TEST(GamutRatio, FewPixelsAreNoPartOfAGamutInSmallPicturesAndInLarge) {
  const std::vector<Lab> small = joined(filled(0, 0, 10, 10, 3), filled(200, 0, 1, 1, 2));
  EXPECT_EQ(gamut_ratio(small, small).reference_bins, 100U) << "2 pixels of 302 are not enough, 3 are";
  // 4e5 pixels: 1e-5 of them are 4.
  const auto large = [](int stray) { return joined(filled(0, 0, 10, 10, 3999), filled(200, 0, 1, 100 - stray, 1)); };
  const std::vector<Lab> three = joined(large(3), filled(300, 0, 1, 1, 3));
  const std::vector<Lab> four = joined(large(4), filled(300, 0, 1, 1, 4));
  ASSERT_EQ(three.size(), 400000U);
  EXPECT_EQ(gamut_ratio(three, four).reference_bins, 100U);
  EXPECT_EQ(gamut_ratio(three, four).test_bins, 101U);
}

TEST(GamutRatio, WithoutAnAreaThereIsNoConvexRatio) {
  const std::vector<Lab> area = filled(0, 0, 9, 9, 3), line = filled(0, 0, 9, 1, 3), none;
  EXPECT_TRUE(std::isnan(gamut_ratio(line, area).convex_percent));
  EXPECT_EQ(gamut_ratio(line, area).occupancy_percent, 100);
  EXPECT_EQ(gamut_ratio(area, line).convex_percent, 0);
  EXPECT_TRUE(std::isnan(gamut_ratio(none, area).occupancy_percent));
  EXPECT_EQ(gamut_ratio(area, none).occupancy_percent, 0);
}

TEST(GamutRatio, WhatIsNotFiniteOrTooFarIsDroppedAndCounted) {
  GamutBins bins;
  const double reach = gamut_reach;
  bins.add(std::vector<Lab>{{nan, 0, 0}, {50, inf, 0}, {50, 0, -inf}});
  bins.add(std::vector<Lab>{{50, reach, 0}, {50, 0, -reach - 1e-9}, {50, 1e300, 0}, {50, 0, -1e300}});
  bins.add(std::vector<Lab>{{50, std::nextafter(reach, 0), 0}, {50, 0, -reach}, {-5, 0, 0}});
  EXPECT_EQ(bins.not_finite(), 3U);
  EXPECT_EQ(bins.beyond(), 4U);
  EXPECT_EQ(bins.counted(), 3U);
}

TEST(GamutRatio, TheBorderOfTheReachCounts) {
  const int r = gamut_reach;
  const std::vector<Lab> corners = joined(joined(filled(-r, -r, 1, 1, 3), filled(r - 1, -r, 1, 1, 3)),
                                          joined(filled(-r, r - 1, 1, 1, 3), filled(r - 1, r - 1, 1, 1, 3)));
  const GamutRatio found = gamut_ratio(corners, corners);
  EXPECT_EQ(found.reference_bins, 4U);
  EXPECT_NEAR(found.convex_percent, 100, 1e-11);
}

}  // namespace
}  // namespace lowlux::isp
