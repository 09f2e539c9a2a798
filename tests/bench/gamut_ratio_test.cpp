#include "isp/bench/gamut_ratio.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "isp/bench/statistics.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

using Points = std::vector<GamutPoint>;

HullAreas areas_of(const Points& reference, const Points& test) {
  HullAreas out{nan, nan, nan};
  EXPECT_TRUE(lowlux_measure_hulls({reference.data(), static_cast<int>(reference.size())},
                                   {test.data(), static_cast<int>(test.size())}, &out));
  return out;
}

double percent(const Points& reference, const Points& test) { return convex_percent(areas_of(reference, test)); }

const Points square{{-20, -20}, {20, -20}, {20, 20}, {-20, 20}};

TEST(GamutHull, HasItsCheckValues) {
  EXPECT_NEAR(percent(square, {{0, 0}, {30, 0}, {30, 10}, {0, 10}}), 12.5, 1e-5);
  Points disc;
  for (int degrees = 0; degrees < 360; ++degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    disc.push_back({static_cast<float>(10 * std::cos(angle)), static_cast<float>(10 * std::sin(angle))});
  }
  // 360 triangles, 100 * 180 * 100 sin(1 degree) / 1600 = 19.633957; of floats, 1e-6 of 10 along the edge.
  EXPECT_NEAR(percent(square, disc), 19.633957, 2e-5);
  EXPECT_NEAR(percent(disc, square), 100, 1e-4);
}

TEST(GamutHull, OrderPlaceAndInnerPointsDoNotMatter) {
  const Points test{{0, 0}, {30, 0}, {30, 10}, {0, 10}};
  Points shuffled{{5, 5}, {30, 10}, {0, 0}, {0, 10}, {30, 0}, {30, 5}, {0, 0}};
  EXPECT_NEAR(percent(square, shuffled), 12.5, 1e-5);
  std::ranges::reverse(shuffled);
  EXPECT_NEAR(percent(square, shuffled), 12.5, 1e-5);
  const auto moved = [](Points points) {
    for (GamutPoint& p : points) p = {p.a + 100.5F, p.b - 37};
    return points;
  };
  EXPECT_NEAR(percent(moved(square), moved(test)), 12.5, 1e-5);
}

TEST(GamutHull, DegenerateHullsHaveNoArea) {
  const Points none, one{{1, 2}}, line{{0, 0}, {5, 5}, {10, 10}, {2, 2}};
  for (const Points& flat : {none, one, line}) {
    EXPECT_EQ(percent(square, flat), 0);
    EXPECT_TRUE(std::isnan(percent(flat, square)));
    EXPECT_TRUE(std::isnan(percent(flat, flat)));
  }
  EXPECT_EQ(percent(square, {{30, 30}, {40, 30}, {40, 40}}), 0) << "they do not meet";
  EXPECT_EQ(percent(square, {{20, -20}, {40, -20}, {40, 20}, {20, 20}}), 0) << "they share an edge alone";
}

/// Area of a convex polygon cut by another, each anticlockwise: one line of the other after another (Sutherland &
/// Hodgman 1974), in double.
double shared_area(std::vector<Xy> polygon, const std::vector<Xy>& cutter) {
  for (std::size_t i = 0; i < cutter.size(); ++i) {
    const Xy from = cutter[i], to = cutter[(i + 1) % cutter.size()];
    const auto side = [&](const Xy& p) { return (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x); };
    std::vector<Xy> kept;
    for (std::size_t j = 0; j < polygon.size(); ++j) {
      const Xy p = polygon[j], q = polygon[(j + 1) % polygon.size()];
      const double sp = side(p), sq = side(q);
      if (sp >= 0) kept.push_back(p);
      if ((sp > 0 && sq < 0) || (sp < 0 && sq > 0)) {
        const double t = sp / (sp - sq);
        kept.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
      }
    }
    polygon = kept;
  }
  return hull_area(polygon);
}

/// Corners on an ellipse of bin centres: convex but for its rounding, which the hull below removes.
std::vector<Xy> drawn(std::mt19937& random, int corners) {
  std::uniform_real_distribution<double> any(-60, 60), size(10, 80);
  const double a = any(random), b = any(random), along = size(random), across = size(random);
  std::vector<Xy> out;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    out.push_back({a + along * std::cos(angle), b + across * std::sin(angle)});
  }
  return out;
}

TEST(GamutHull, OfDrawnPolygonsAgreesWithCuttingThemInDouble) {
  std::mt19937 random(5);
  const auto floats = [](const std::vector<Xy>& polygon) {
    Points out;
    for (const Xy& p : polygon) out.push_back({static_cast<float>(p.x), static_cast<float>(p.y)});
    return out;
  };
  int apart = 0;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Xy> first = drawn(random, 3 + i % 20);
    const std::vector<Xy> second = i % 10 == 0 ? first : drawn(random, 3 + i % 7);
    const HullAreas found = areas_of(floats(first), floats(second));
    const double largest = std::max(hull_area(first), hull_area(second));
    // 1e-5 of the larger hull: single precision, as the header says.
    EXPECT_NEAR(found.reference, hull_area(first), 1e-5 * largest);
    EXPECT_NEAR(found.test, hull_area(second), 1e-5 * largest);
    EXPECT_NEAR(found.both, shared_area(first, second), 1e-5 * largest) << i;
    apart += found.both == 0 ? 1 : 0;
  }
  EXPECT_GT(apart, 0);
  EXPECT_LT(apart, 200);
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
  const GamutRatio found = gamut_ratio(reference, test, lowlux_measure_hulls);
  ASSERT_TRUE(found.convex_percent);
  EXPECT_NEAR(*found.convex_percent, 12.5, 1e-5);  // 20 x 10 of 40 x 40 between centres
  EXPECT_EQ(found.reference_bins, 41U * 41);
  EXPECT_EQ(found.test_bins, 31U * 11);
  EXPECT_DOUBLE_EQ(found.occupancy_percent, 100 * 21.0 * 11 / (41 * 41));
  const GamutRatio same = gamut_ratio(reference, reference, lowlux_measure_hulls);
  EXPECT_NEAR(same.convex_percent.value(), 100, 1e-4);
  EXPECT_EQ(same.occupancy_percent, 100);
}

TEST(GamutRatio, OccupancySeesTheHoleThatTheHullCovers) {
  const std::vector<Lab> reference = filled(-10, -10, 21, 21, 3);
  const std::vector<Lab> corners = joined(joined(filled(-10, -10, 1, 1, 3), filled(10, -10, 1, 1, 3)),
                                          joined(filled(-10, 10, 1, 1, 3), filled(10, 10, 1, 1, 3)));
  const GamutRatio found = gamut_ratio(reference, corners, lowlux_measure_hulls);
  EXPECT_NEAR(found.convex_percent.value(), 100, 1e-4);
  EXPECT_DOUBLE_EQ(found.occupancy_percent, 100 * 4.0 / (21 * 21));
}

TEST(GamutRatio, FewPixelsAreNoPartOfAGamutInSmallPicturesAndInLarge) {
  const std::vector<Lab> small = joined(filled(0, 0, 10, 10, 3), filled(200, 0, 1, 1, 2));
  EXPECT_EQ(gamut_ratio(small, small, nullptr).reference_bins, 100U) << "2 pixels of 302 are not enough, 3 are";
  // 4e5 pixels: 1e-5 of them are 4.
  const auto large = [](int stray) { return joined(filled(0, 0, 10, 10, 3999), filled(200, 0, 1, 100 - stray, 1)); };
  const std::vector<Lab> three = joined(large(3), filled(300, 0, 1, 1, 3));
  const std::vector<Lab> four = joined(large(4), filled(300, 0, 1, 1, 4));
  ASSERT_EQ(three.size(), 400000U);
  EXPECT_EQ(gamut_ratio(three, four, nullptr).reference_bins, 100U);
  EXPECT_EQ(gamut_ratio(three, four, nullptr).test_bins, 101U);
}

TEST(GamutRatio, WithoutAnAreaThereIsNoConvexRatioAndWithoutTheModuleNoneAtAll) {
  const std::vector<Lab> area = filled(0, 0, 9, 9, 3), line = filled(0, 0, 9, 1, 3), none;
  EXPECT_TRUE(std::isnan(gamut_ratio(line, area, lowlux_measure_hulls).convex_percent.value()));
  EXPECT_EQ(gamut_ratio(line, area, lowlux_measure_hulls).occupancy_percent, 100);
  EXPECT_EQ(gamut_ratio(area, line, lowlux_measure_hulls).convex_percent.value(), 0);
  EXPECT_TRUE(std::isnan(gamut_ratio(none, area, lowlux_measure_hulls).occupancy_percent));
  EXPECT_EQ(gamut_ratio(area, none, lowlux_measure_hulls).occupancy_percent, 0);
  EXPECT_FALSE(gamut_ratio(area, area, nullptr).convex_percent);
  const auto fails = [](const GamutPoints&, const GamutPoints&, HullAreas*) noexcept { return false; };
  EXPECT_FALSE(gamut_ratio(area, area, fails).convex_percent);
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
  const GamutRatio found = gamut_ratio(corners, corners, lowlux_measure_hulls);
  EXPECT_EQ(found.reference_bins, 4U);
  EXPECT_NEAR(found.convex_percent.value(), 100, 1e-3);
}

}  // namespace
}  // namespace lowlux::isp
