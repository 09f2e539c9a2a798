#include "isp/model/colour/chromaticity_cloud.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

using test::nan;

constexpr double degree = std::numbers::pi / 180;

Xy on_ellipse(const XyEllipse& e, double angle_deg, double scale = 1) {
  const double u = scale * e.semi_major * std::cos(angle_deg * degree);
  const double v = scale * e.semi_minor * std::sin(angle_deg * degree);
  const double c = std::cos(e.inclination_deg * degree), s = std::sin(e.inclination_deg * degree);
  return {e.centre.x + u * c - v * s, e.centre.y + u * s + v * c};
}

// 1 on the ellipse, less inside.
double reach(const XyEllipse& e, const Xy& p) {
  const double c = std::cos(e.inclination_deg * degree), s = std::sin(e.inclination_deg * degree);
  const double dx = p.x - e.centre.x, dy = p.y - e.centre.y;
  return std::hypot((dx * c + dy * s) / e.semi_major, (-dx * s + dy * c) / e.semi_minor);
}

TEST(Cloud, MeanAndCovarianceOfFourPointsAreThoseByHand) {
  const std::vector<Xy> points{{1, 1}, {3, 1}, {1, 2}, {3, 4}};
  const auto cloud = cloud_of(points);
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->mean, (Xy{2, 2}));
  EXPECT_DOUBLE_EQ(cloud->covariance.xx, 4.0 / 3);
  EXPECT_DOUBLE_EQ(cloud->covariance.xy, 2.0 / 3);
  EXPECT_DOUBLE_EQ(cloud->covariance.yy, 6.0 / 3);
}

TEST(Cloud, NeedsTwoFiniteSamples) {
  EXPECT_FALSE(cloud_of({}));
  EXPECT_FALSE(cloud_of(std::vector<Xy>{{0.3, 0.3}}));
  EXPECT_FALSE(cloud_of(std::vector<Xy>{{0.3, 0.3}, {nan, 0.3}}));
  EXPECT_TRUE(cloud_of(std::vector<Xy>{{0.3, 0.3}, {0.3, 0.3}}));
}

TEST(PrincipalEllipse, RestoresAxesAndInclinationOfARotatedCovariance) {
  for (const double angle : test::steps(0, 179.5, 7.5)) {
    const double c = std::cos(angle * degree), s = std::sin(angle * degree);
    const ChromaticityCloud cloud{{0.3, 0.3}, {9e-6 * c * c + 4e-6 * s * s, 5e-6 * s * c, 9e-6 * s * s + 4e-6 * c * c}};
    const XyEllipse e = principal_ellipse(cloud, 10);
    EXPECT_NEAR(e.semi_major, 0.03, 1e-15);
    EXPECT_NEAR(e.semi_minor, 0.02, 1e-15);
    EXPECT_GE(e.inclination_deg, 0);
    EXPECT_LT(e.inclination_deg, 180);
    EXPECT_NEAR(inclination_difference_deg(e.inclination_deg, angle), 0, 1e-10);
    EXPECT_NEAR(size_of(e), std::hypot(0.03, 0.02), 1e-15);
  }
}

TEST(PrincipalEllipse, OfACircleAPointAndALineAreWhatTheyAre) {
  EXPECT_EQ(principal_ellipse({{0, 0}, {4, 0, 4}}, 1).semi_major, 2);
  EXPECT_EQ(principal_ellipse({{0, 0}, {4, 0, 4}}, 1).inclination_deg, 0);
  EXPECT_EQ(size_of(principal_ellipse({{0, 0}, {0, 0, 0}}, 10)), 0);
  const XyEllipse line = principal_ellipse({{0, 0}, {1, -1, 1}}, 1);
  EXPECT_EQ(line.semi_minor, 0);
  EXPECT_DOUBLE_EQ(line.inclination_deg, 135);
  EXPECT_EQ(principal_ellipse({{0, 0}, {1, -1e-30, 0}}, 1).inclination_deg, 0);  // not 180
}

TEST(Inclinations, DifferAroundTheHalfTurn) {
  EXPECT_DOUBLE_EQ(inclination_difference_deg(179, 1), -2);
  EXPECT_DOUBLE_EQ(inclination_difference_deg(1, 179), 2);
  EXPECT_DOUBLE_EQ(inclination_difference_deg(50, 20), 30);
}

TEST(EnclosingEllipse, OfPointsOnAnEllipseAndInsideItIsThatEllipse) {
  const XyEllipse truth{{0.35, 0.32}, 3e-3, 4e-4, 63};
  std::vector<Xy> points;
  for (const double angle : test::steps(0, 350, 10)) {
    points.push_back(on_ellipse(truth, angle));
    points.push_back(on_ellipse(truth, angle + 3, 0.7));
  }
  const auto found = enclosing_ellipse(points);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->centre.x, truth.centre.x, 1e-6 * truth.semi_major);  // the algorithm's tolerance, 1e-7, and room
  EXPECT_NEAR(found->centre.y, truth.centre.y, 1e-6 * truth.semi_major);
  EXPECT_NEAR(found->semi_major, truth.semi_major, 1e-6 * truth.semi_major);
  EXPECT_NEAR(found->semi_minor, truth.semi_minor, 1e-6 * truth.semi_minor);
  EXPECT_NEAR(found->inclination_deg, truth.inclination_deg, 1e-4);
}

TEST(EnclosingEllipse, OfATriangleIsSteinersEllipse) {
  // Area of Steiner's circumellipse: 4 pi / (3 sqrt 3) times the triangle's.
  const std::vector<Xy> triangle{{0.1, 0.1}, {0.6, 0.15}, {0.3, 0.7}};
  const double area = 0.5 * std::fabs((0.5 * 0.6) - (0.2 * 0.05));
  const auto found = enclosing_ellipse(triangle);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->centre.x, 1.0 / 3, 1e-6);  // centroid
  EXPECT_NEAR(found->centre.y, 0.95 / 3, 1e-6);
  EXPECT_NEAR(std::numbers::pi * found->semi_major * found->semi_minor,
              area * 4 * std::numbers::pi / 3 / std::sqrt(3.0), 1e-6);
}

TEST(EnclosingEllipse, HoldsAllSamplesAndNoNearbyEllipseIsSmaller) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const double scale : {1e-9, 1e-3}) {
    std::vector<Xy> points;
    for (int i = 0; i < 200; ++i) {
      const double u = normal(random), v = normal(random);
      points.push_back({0.31 + scale * (2 * u + v), 0.33 + scale * (u - 0.3 * v)});
    }
    const auto found = enclosing_ellipse(points);
    ASSERT_TRUE(found);
    double farthest = 0;
    for (const Xy& p : points) farthest = std::max(farthest, reach(*found, p));
    EXPECT_NEAR(farthest, 1, scale < 1e-6 ? 1e-5 : 1e-9);  // 1e-9 wide at 0.3: seven digits are left
    // Any change of shape or centre that still holds all samples has a larger area.
    for (const double d : {-1e-2, 1e-2}) {
      for (int change = 0; change < 4; ++change) {
        XyEllipse other = *found;
        if (change == 0) other.centre.x += d * found->semi_major;
        if (change == 1) other.centre.y += d * found->semi_major;
        if (change == 2) other.inclination_deg += 50 * d;
        if (change == 3) other.semi_minor *= 1 + d;
        double needed = 0;
        for (const Xy& p : points) needed = std::max(needed, reach(other, p));
        EXPECT_GT(needed * needed * other.semi_major * other.semi_minor, found->semi_major * found->semi_minor);
      }
    }
  }
}

TEST(EnclosingEllipse, NeedsThreeSamplesThatSpanThePlane) {
  EXPECT_FALSE(enclosing_ellipse({}));
  EXPECT_FALSE(enclosing_ellipse(std::vector<Xy>{{0.1, 0.2}, {0.2, 0.1}}));
  EXPECT_FALSE(enclosing_ellipse(std::vector<Xy>{{0.1, 0.2}, {0.2, 0.3}, {0.3, 0.4}, {0.5, 0.6}}));
  EXPECT_FALSE(enclosing_ellipse(std::vector<Xy>{{0.1, 0.2}, {0.1, 0.3}, {0.1, 0.4}}));
  EXPECT_FALSE(enclosing_ellipse(std::vector<Xy>{{0.1, 0.2}, {0.1, 0.2}, {0.1, 0.2}}));
  EXPECT_FALSE(enclosing_ellipse(std::vector<Xy>{{0.1, 0.2}, {nan, 0.3}, {0.3, 0.1}}));
}

TEST(PropagatedCloud, AgreesWithDerivativesByDifferences) {
  const Xyz mean{20, 15, 40};
  const Matrix3 covariance{{{0.5, 0.1, -0.05}, {0.1, 0.4, 0.02}, {-0.05, 0.02, 0.9}}};
  double j[2][3];
  for (int k = 0; k < 3; ++k) {
    Vector3 up = vector_of(mean), down = up;
    up[k] += 1e-4, down[k] -= 1e-4;
    j[0][k] = (xy_of(xyz_of(up))->x - xy_of(xyz_of(down))->x) / 2e-4;
    j[1][k] = (xy_of(xyz_of(up))->y - xy_of(xyz_of(down))->y) / 2e-4;
  }
  const auto form = [&](int a, int b) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) sum += j[a][k] * covariance[k][l] * j[b][l];
    }
    return sum;
  };
  const auto cloud = propagated_cloud(mean, covariance);
  ASSERT_TRUE(cloud);
  EXPECT_NEAR(cloud->covariance.xx, form(0, 0), 1e-12);  // central differences: 1e-8 of 1e-5
  EXPECT_NEAR(cloud->covariance.xy, form(0, 1), 1e-12);
  EXPECT_NEAR(cloud->covariance.yy, form(1, 1), 1e-12);
  EXPECT_FALSE(propagated_cloud({0, 0, 0}, covariance));
  EXPECT_FALSE(propagated_cloud({1, 1, -2}, covariance));
}

TEST(PredictedCloud, ScalesWithOneOverThePhotonsAndKeepsItsInclination) {
  const Spectrum light = *light_named("A");
  const auto bright = predicted_cloud(*mean_photons(light, 1, 0.2));
  const auto dim = predicted_cloud(*mean_photons(light, 6e-15, 0.2));
  ASSERT_TRUE(bright && dim);
  EXPECT_NEAR(dim->covariance.xx * 6e-15 / bright->covariance.xx, 1, 1e-12);
  EXPECT_NEAR(principal_ellipse(*dim, 10).inclination_deg, principal_ellipse(*bright, 10).inclination_deg, 1e-9);
  EXPECT_NEAR(bright->mean.x, xy_of(xyz_of(light))->x, 1e-14);
  EXPECT_NEAR(bright->mean.y, xy_of(xyz_of(light))->y, 1e-14);
}

TEST(PredictedCloud, OfTwoLinesIsOnTheLineBetweenTheirChromaticities) {
  const auto means = mean_photons(*Spectrum::of({450, 500, 600, 650}, {0, 1, 1, 0}), 1e-14, 0.2);
  const XyEllipse e = principal_ellipse(*predicted_cloud(*means), 1);
  const auto& observer = cie_1931_observer();
  const auto line = [&](double nm) { return *xy_of(Xyz{observer[0].at(nm), observer[1].at(nm), observer[2].at(nm)}); };
  const double angle = std::atan2(line(500).y - line(600).y, line(500).x - line(600).x) / degree;
  EXPECT_NEAR(inclination_difference_deg(e.inclination_deg, angle), 0, 1e-9);
  EXPECT_LT(e.semi_minor, 1e-6 * e.semi_major);
}

TEST(PredictedCloud, IsNoneWithoutPhotonsTheObserverSees) {
  EXPECT_FALSE(predicted_cloud(*mean_photons(*light_named("A"), 0, 1)));
  EXPECT_FALSE(predicted_cloud(*mean_photons(*Spectrum::of({900, 950, 1000}, {1, 1, 1}), 1, 1)));
}

}  // namespace
}  // namespace lowlux::isp
