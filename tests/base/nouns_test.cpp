#include <gtest/gtest.h>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"

namespace lowlux {
namespace {

constexpr CfaColour R = CfaColour::red, G = CfaColour::green, B = CfaColour::blue;

TEST(Cfa, PhasesNameTheFirstCellRowByRow) {
  const std::pair<BayerPhase, std::array<CfaColour, 4>> cells[] = {
      {BayerPhase::rggb, {R, G, G, B}},
      {BayerPhase::grbg, {G, R, B, G}},
      {BayerPhase::gbrg, {G, B, R, G}},
      {BayerPhase::bggr, {B, G, G, R}},
  };
  for (const auto& [phase, colours] : cells) {
    for (int site = 0; site < 4; ++site) {
      EXPECT_EQ(colour_at(phase, site & 1, site >> 1), colours[site]);
      EXPECT_EQ(colour_at(phase, 6 + (site & 1), 4 + (site >> 1)), colours[site]);
    }
  }
}

TEST(Cfa, ACropSeesTheColoursOfItsCorner) {
  for (int phase = 0; phase < 4; ++phase) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 3; ++x) {
        const BayerPhase cropped = phase_of_crop(static_cast<BayerPhase>(phase), x, y);
        for (int site = 0; site < 4; ++site) {
          EXPECT_EQ(colour_at(cropped, site & 1, site >> 1),
                    colour_at(static_cast<BayerPhase>(phase), x + (site & 1), y + (site >> 1)));
        }
      }
    }
  }
}

TEST(Matrix3, InverseTimesMatrixIsIdentity) {
  const Matrix3 m{{{0.6461, -0.1164, -0.0857}, {-0.3825, 1.1597, 0.2534}, {-0.0416, 0.154, 0.6039}}};
  const auto inv = inverse(m);
  ASSERT_TRUE(inv);
  const Matrix3 product = *inv * m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(product[i][j], i == j, 1e-14);  // a few roundings of numbers near 1
  }
}

TEST(Matrix3, SingularAndNonFiniteMatricesHaveNoInverse) {
  EXPECT_FALSE(inverse(Matrix3{}));
  EXPECT_FALSE(inverse(Matrix3{{{1, 2, 3}, {2, 4, 6}, {0, 0, 1}}}));
  EXPECT_FALSE(inverse(Matrix3{{{NAN, 0, 0}, {0, 1, 0}, {0, 0, 1}}}));
  EXPECT_FALSE(inverse(Matrix3{{{INFINITY, 0, 0}, {0, 1, 0}, {0, 0, 1}}}));
  EXPECT_TRUE(inverse(1e-9 * identity3()));  // small is not singular
}

TEST(BlackLevel, RepeatsItsPatternAndAddsColumnAndRowOffsets) {
  BlackLevel black{.rows = 2, .columns = 3, .pattern_dn = {1, 2, 3, 4, 5, 6}};
  EXPECT_EQ(black.at(0, 0), 1);
  EXPECT_EQ(black.at(4, 3), 5);
  black.column_dn = {0, 0, 0, 0, 0.5};
  black.row_dn = {0, 0, 0, -2};
  EXPECT_EQ(black.at(4, 3), 3.5);
}

TEST(Plane, CropSharesTheSamplesOfItsOwner) {
  Plane<int> plane(4, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) plane.at(x, y) = 10 * y + x;
  }
  const PlaneView<int> crop = plane.view().crop(1, 1, 2, 2);
  EXPECT_EQ(crop.at(0, 0), 11);
  EXPECT_EQ(crop.at(1, 1), 22);
  crop.at(0, 0) = 99;
  EXPECT_EQ(plane.at(1, 1), 99);
  const Plane<int> copy = plane.clone();
  plane.at(1, 1) = 0;
  EXPECT_EQ(copy.at(1, 1), 99);
}

}  // namespace
}  // namespace lowlux
