#include "isp/metrics/convex_hull.h"
#include "isp/metrics/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lowlux::isp {
namespace {

// A normal cloud with covariance (4, 1.2; 1.2, 1), exact in distribution.
std::vector<Xy> normal_cloud(std::mt19937_64& random, int n) {
  std::normal_distribution<double> normal;
  std::vector<Xy> out;
  for (int i = 0; i < n; ++i) {
    const double u = normal(random), v = normal(random);
    out.push_back({2 * u, 0.6 * u + 0.8 * v});
  }
  return out;
}

constexpr XyCovariance truth{4, 1.2, 1};

TEST(Statistics, MeanAndItsErrorOfThreeNumbersAreThoseByHand) {
  const Estimate e = mean_of(std::vector<double>{1, 2, 6});
  EXPECT_DOUBLE_EQ(e.value, 3);
  EXPECT_DOUBLE_EQ(e.standard_error, std::sqrt(7.0 / 3));
}

TEST(Statistics, PowerLawIsExactOnAPowerLawAndFollowsTheBetterPoints) {
  const std::vector<double> x{1e-15, 1e-9, 1e-3, 1};
  std::vector<Estimate> y;
  for (const double v : x) y.push_back({3 - 0.5 * std::log(v), 0.1});
  EXPECT_NEAR(power_law_exponent(x, y).value, -0.5, 1e-14);
  double spread = 0, mean = 0;
  for (const double v : x) mean += std::log(v) / 4;
  for (const double v : x) spread += (std::log(v) - mean) * (std::log(v) - mean);
  EXPECT_NEAR(power_law_exponent(x, y).standard_error, 0.1 / std::sqrt(spread), 1e-15);
  y[1] = {100, 1e9};  // an outlier of no weight
  EXPECT_NEAR(power_law_exponent(x, y).value, -0.5, 1e-12);
}

// Repeats the sampling, and compares the scatter of a statistic with its predicted standard error.
template <class Statistic>
void expect_scatter(const Statistic& statistic, double predicted) {
  std::mt19937_64 random(5);
  constexpr int repeats = 4000;
  std::vector<double> values;
  for (int i = 0; i < repeats; ++i) values.push_back(statistic(cloud_of(normal_cloud(random, 200))->covariance));
  const double scatter = mean_of(values).standard_error * std::sqrt(repeats);
  // Five errors of a sampled deviation, 1 / sqrt(2 repeats), and 2 % for what is of higher order in 1 / 200.
  EXPECT_NEAR(scatter / predicted, 1, 5 / std::sqrt(2.0 * repeats) + 0.02);
}

TEST(Statistics, SizesScatterAsPredicted) {
  expect_scatter([](const XyCovariance& c) { return log_size_of(c, 200).value; },
                 log_size_of(truth, 200).standard_error);
  EXPECT_NEAR(log_size_of(truth, 200).value, std::log(size_of(principal_ellipse({{}, truth}, 1))), 1e-15);
}

// Mean square of the orientation errors of clouds with standard deviations 1 and `minor` along x and y.
double orientation_scatter(double minor) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  constexpr int repeats = 4000;
  double squares = 0;
  for (int i = 0; i < repeats; ++i) {
    std::vector<Xy> points;
    for (int k = 0; k < 100; ++k) {
      const double x = normal(random);
      points.push_back({x, minor * normal(random)});
    }
    const double error = orientation_error(cloud_of(points)->covariance, {1, 0, minor * minor}, 0, 100);
    squares += error * error / repeats;
  }
  return squares;
}

TEST(Statistics, OrientationErrorHasUnitScatterAlsoForNearlyRoundClouds) {
  // Five errors of the mean of 4000 squares of a unit variable: their variance is its kurtosis, 3 + 6 / 99, less 1.
  const double tolerance = 5 * std::sqrt(2.07 / 4000);
  EXPECT_NEAR(orientation_scatter(0.1), 1, tolerance);
  EXPECT_NEAR(orientation_scatter(0.99), 1, tolerance);
}

TEST(Statistics, OrientationErrorIsNoneOnTheAxisAndLargestHalfwayToTheOther) {
  const double inclination = principal_ellipse({{}, truth}, 1).inclination_deg;
  EXPECT_NEAR(orientation_error(truth, truth, inclination, 100), 0, 1e-12);
  const double l1_minus_l2 = std::hypot(3, 2.4), determinant = 4 - 1.44;
  EXPECT_NEAR(orientation_error(truth, truth, inclination + 45, 100), 0.5 * l1_minus_l2 / std::sqrt(determinant / 99),
              1e-12);
}

TEST(Statistics, CovarianceErrorsAreInUnitsOfTheirOwnScatter) {
  const double sxx = std::sqrt(2 * 16.0 / 199), sxy = std::sqrt((4.0 + 1.44) / 199);
  EXPECT_NEAR(worst_covariance_error({4 + 3 * sxx, 1.2, 1}, truth, 200), 3, 1e-12);
  EXPECT_NEAR(worst_covariance_error({4, 1.2 - 2 * sxy, 1}, truth, 200), 2, 1e-12);
  expect_scatter([](const XyCovariance& c) { return c.xx; }, sxx);
  expect_scatter([](const XyCovariance& c) { return c.xy; }, sxy);
}

TEST(Statistics, MeanErrorIsTheMahalanobisDistance) {
  EXPECT_NEAR(mean_error({0.2, 0}, {0, 0}, {4, 0, 1}, 100), 1, 1e-14);
  EXPECT_NEAR(mean_error({0, 0.2}, {0, 0}, {4, 0, 1}, 100), 2, 1e-14);
  EXPECT_EQ(mean_error({1, 1}, {1, 1}, truth, 10), 0);
  EXPECT_TRUE(std::isinf(mean_error({0, 0}, {0, 0}, {1, 1, 1}, 100)));  // no area: nothing can be said
}

TEST(Statistics, HullOfASquareIgnoresPointsInsideAndOnItsSides) {
  const std::vector<Xy> points{{0, 0}, {0.5, 0.5}, {1, 0}, {0.5, 0}, {1, 1}, {0.2, 0.9}, {0, 1}, {0, 0}};
  EXPECT_DOUBLE_EQ(hull_area(points), 1);
  EXPECT_EQ(hull_area(std::vector<Xy>{{0, 0}, {1, 1}}), 0);
  EXPECT_EQ(hull_area(std::vector<Xy>{{0, 0}, {1, 1}, {2, 2}}), 0);
  EXPECT_EQ(hull_area(std::vector<Xy>{{1, 1}, {1, 1}, {1, 1}}), 0);
  EXPECT_EQ(hull_area({}), 0);
}

}  // namespace
}  // namespace lowlux::isp
