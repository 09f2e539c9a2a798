#include "isp/render/profile_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace lowlux::isp {
namespace {

/// Solves the natural spline by Gaussian elimination over the full matrix, in long double: as many unknown second
/// derivatives as points.
std::vector<long double> bends_of(const std::vector<CurvePoint>& p) {
  const std::size_t n = p.size();
  std::vector<std::vector<long double>> rows(n, std::vector<long double>(n + 1, 0));
  rows[0][0] = rows[n - 1][n - 1] = 1;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const long double before = p[i].x - p[i - 1].x, after = p[i + 1].x - p[i].x;
    rows[i][i - 1] = before / 6;
    rows[i][i] = (before + after) / 3;
    rows[i][i + 1] = after / 6;
    rows[i][n] = (p[i + 1].y - p[i].y) / after - (p[i].y - p[i - 1].y) / before;
  }
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k) continue;
      const long double factor = rows[i][k] / rows[k][k];
      for (std::size_t j = 0; j <= n; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  std::vector<long double> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = rows[i][n] / rows[i][i];
  return out;
}

double oracle(const std::vector<CurvePoint>& p, double x) {
  const auto bend = bends_of(p);
  std::size_t i = 1;
  while (i + 1 < p.size() && x >= p[i].x) ++i;
  const long double h = p[i].x - p[i - 1].x, a = (p[i].x - x) / h, b = (x - p[i - 1].x) / h;
  const long double y =
      a * p[i - 1].y + b * p[i].y + ((a * a * a - a) * bend[i - 1] + (b * b * b - b) * bend[i]) * h * h / 6;
  return std::clamp(static_cast<double>(y), 0.0, 1.0);
}

std::vector<CurvePoint> random_points(std::mt19937& draw) {
  std::uniform_real_distribution<double> fraction(0.02, 0.98);
  std::vector<double> x, y;
  for (unsigned i = draw() % 12; i > 0; --i) x.push_back(fraction(draw)), y.push_back(fraction(draw));
  std::sort(x.begin(), x.end());
  std::sort(y.begin(), y.end());
  std::vector<CurvePoint> out{{0, 0}};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] > out.back().x + 0.01) out.push_back({x[i], y[i]});
  }
  out.push_back({1, 1});
  return out;
}

TEST(ProfileCurve, IsTheNaturalSplineThroughItsPoints) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> place(0, 1);
  for (int curve = 0; curve < 50; ++curve) {
    const std::vector<CurvePoint> points = random_points(draw);
    std::vector<double> at;
    for (const CurvePoint& point : points) at.push_back(point.x);
    for (int i = 0; i < 20; ++i) at.push_back(place(draw));
    const std::vector<double> found = spline_values(points, at);
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(found[i], oracle(points, at[i]), 1e-9) << at[i];
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(found[i], points[i].y, 1e-12);
  }
}

// The table's steps are even in the square root of x: its error is that of lines between neighbours, and of floats.
TEST(ProfileCurve, AppliesToGreyWhatTheSplineStates) {
  const std::vector<CurvePoint> points{{0, 0}, {0.05, 0.02}, {0.18, 0.3}, {0.6, 0.8}, {1, 1}};
  const auto curve = make_profile_curve(points);
  ASSERT_TRUE(curve);
  EXPECT_EQ(curve->points, 5);
  EXPECT_NEAR(oracle(points, curve->mid_grey), 0.18, 1e-3);
  for (double x = 0; x <= 1; x += 1.0 / 997) {
    float rgb[3] = {static_cast<float>(x), static_cast<float>(x), static_cast<float>(x)};
    apply_profile_curve(*curve, rgb);
    for (const float channel : rgb) EXPECT_NEAR(channel, oracle(points, x), 2e-6) << x;
  }
}

TEST(ProfileCurve, KeepsTheHue) {
  const auto curve = make_profile_curve(std::vector<CurvePoint>{{0, 0}, {0.2, 0.4}, {1, 1}});
  ASSERT_TRUE(curve);
  std::mt19937 draw(3);
  std::uniform_real_distribution<float> channel(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const std::array<float, 3> before{channel(draw), channel(draw), channel(draw)};
    float rgb[3] = {before[0], before[1], before[2]};
    apply_profile_curve(*curve, rgb);
    const auto [low, high] = std::minmax_element(before.begin(), before.end());
    const auto [out_low, out_high] = std::minmax({rgb[0], rgb[1], rgb[2]});
    for (int c = 0; c < 3; ++c) {
      const float place = (before[c] - *low) / (*high - *low);
      EXPECT_NEAR((rgb[c] - out_low) / (out_high - out_low), place, 1e-4f);
    }
  }
  float over[3] = {2, 1.5f, -0.1f};
  apply_profile_curve(*curve, over);
  EXPECT_NEAR(over[0], 1, 1e-6);
  EXPECT_NEAR(over[1], 1, 1e-6);
  EXPECT_NEAR(over[2], -0.1, 1e-6) << "noise below black stays signed";
}

TEST(ProfileCurve, RefusesWhatTheSpecificationDoes) {
  const auto made = [](const std::vector<CurvePoint>& points) { return make_profile_curve(points).has_value(); };
  EXPECT_TRUE(made({{0, 0}, {1, 1}}));
  EXPECT_FALSE(made({}));
  EXPECT_FALSE(made({{0, 0}}));
  EXPECT_FALSE(made({{0, 0.1}, {1, 1}}));
  EXPECT_FALSE(made({{0, 0}, {1, 0.9}}));
  EXPECT_FALSE(made({{0, 0}, {0.5, 0.2}, {0.5, 0.3}, {1, 1}}));
  EXPECT_FALSE(made({{0, 0}, {0.6, 0.2}, {0.5, 0.3}, {1, 1}}));
  EXPECT_FALSE(made({{0, 0}, {0.5, 1.2}, {1, 1}}));
  EXPECT_FALSE(made({{0, 0}, {NAN, 0.5}, {1, 1}}));
  EXPECT_FALSE(made({{0, 0}, {0.5, NAN}, {1, 1}}));
  EXPECT_FALSE(made(std::vector<CurvePoint>(max_curve_points + 1)));
}

}  // namespace
}  // namespace lowlux::isp
