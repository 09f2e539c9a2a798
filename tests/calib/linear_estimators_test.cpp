#include "calib/dark/dark_fit.h"

#include <vector>

#include <gtest/gtest.h>

namespace lowlux::calib {
namespace {

TEST(LinearEstimators, GiveBackTheParametersOfExactObservations) {
  const Design design{{1, 0, 0}, {1, 2, 0}, {1, 0, 3}, {1, 5, 0}, {1, 0, 1}};
  const std::vector<double> weights{1, 2, 0.5, 3, 10};
  const auto found = linear_estimators(design, weights);
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < design.size(); ++k) product += (*found)[i][k] * design[k][j];
      EXPECT_NEAR(product, i == j, 1e-12);  // doubles, sums of five
    }
  }
}

TEST(LinearEstimators, OfAConstantAreTheWeights) {
  const std::vector<double> weights{1, 3};
  const auto found = linear_estimators({{1}, {1}}, weights);
  ASSERT_TRUE(found);
  EXPECT_DOUBLE_EQ((*found)[0][0], 0.25);
  EXPECT_DOUBLE_EQ((*found)[0][1], 0.75);
}

TEST(LinearEstimators, AreNoneWhereParametersAreNotDetermined) {
  const std::vector<double> weights{1, 1};
  EXPECT_FALSE(linear_estimators({}, {}));
  EXPECT_FALSE(linear_estimators({{1, 2}, {1, 2}}, weights));
  EXPECT_FALSE(linear_estimators({{1, 0}, {1, 0}}, weights));
  EXPECT_TRUE(linear_estimators({{1, 2}, {1, 3}}, weights));
}

}  // namespace
}  // namespace lowlux::calib
