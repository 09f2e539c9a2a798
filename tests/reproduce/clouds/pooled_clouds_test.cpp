#include "isp/reproduce/clouds/chromaticity_clouds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace lowlux::isp {
namespace {

Cloud cloud_at(std::vector<Xy> samples, const XyCovariance& predicted) {
  Cloud out{1, std::move(samples), {}, {{}, predicted}};
  out.sampled = *cloud_of(out.samples);
  return out;
}

TEST(ChromaticityError, IsMeanAndDeviationOfDistancesByHand) {
  // Distances 5, 0 and 13 from the bright chromaticity (Eq. 3.11, 3.12): mean 6, sum of squared differences 1 + 36
  // + 49.
  const ChromaticityError error = chromaticity_error(cloud_at({{4, 5}, {1, 1}, {6, 13}}, {}), {1, 1});
  EXPECT_NEAR(error.mean, 6, 1e-14);
  EXPECT_NEAR(error.deviation, std::sqrt(86 / 2.0), 1e-14);
  EXPECT_NEAR(error.mean_square, (25 + 169) / 3.0, 1e-13);
}

TEST(PooledCloud, HoldsTheSamplesOfAllLevelsDownToTheLast) {
  const Colour colour{"c",
                      *Spectrum::of({400, 700}, {1, 1}),
                      {cloud_at({{0, 0}, {2, 0}}, {1, 0, 2}), cloud_at({{0, 4}, {2, 4}}, {3, 1, 4}),
                       cloud_at({{9, 9}, {8, 8}}, {5, 5, 5})}};
  const PooledCloud one = pooled_cloud(colour, 0), two = pooled_cloud(colour, 1);
  EXPECT_DOUBLE_EQ(one.sampled.covariance.xx, 2);
  EXPECT_DOUBLE_EQ(one.predicted.yy, 2);
  EXPECT_DOUBLE_EQ(two.sampled.mean.y, 2);
  EXPECT_DOUBLE_EQ(two.sampled.covariance.xx, 4 / 3.0);
  EXPECT_DOUBLE_EQ(two.sampled.covariance.yy, 16 / 3.0);
  EXPECT_DOUBLE_EQ(two.predicted.xx, 2);  // the mean of the levels
  EXPECT_DOUBLE_EQ(two.predicted.xy, 0.5);
}

TEST(CentredEllipse, IsTheUnitCircleAroundTwoOfItsPoints) {
  // The least ellipse with a free centre around three points is Steiner's; centred, their mirror images count too.
  const std::vector<Xy> samples{{1.25, 0.5}, {0.25, 1.5}, {0.25, 0.75}};
  const auto ellipse = centred_ellipse({0.25, 0.5}, samples);
  ASSERT_TRUE(ellipse);
  EXPECT_EQ(ellipse->centre, (Xy{0.25, 0.5}));
  // The area is within 1e-6 of the least, the axes within the root of that.
  EXPECT_NEAR(ellipse->semi_major, 1, 1e-3);
  EXPECT_NEAR(ellipse->semi_minor, 1, 1e-3);
  EXPECT_FALSE(centred_ellipse({0, 0}, std::vector<Xy>{{1, 1}, {2, 2}, {3, 3}}));  // one line
}

TEST(CentredEllipse, IsNeverSmallerThanTheOneWithAFreeCentre) {
  const std::vector<Xy> samples{{0.3, 0.3}, {0.36, 0.31}, {0.33, 0.37}, {0.31, 0.34}};
  const auto free = enclosing_ellipse(samples), centred = centred_ellipse({0.3333, 0.3333}, samples);
  ASSERT_TRUE(free && centred);
  EXPECT_GT(centred->semi_major * centred->semi_minor, free->semi_major * free->semi_minor);
}

}  // namespace
}  // namespace lowlux::isp
