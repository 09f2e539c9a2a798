#include "isp/model/colorimetry.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

void expect_near(const Matrix3& found, const Matrix3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], tolerance) << "row " << i << " column " << j;
  }
}

TEST(Chromaticity, ExistsOnlyWhereThereIsLight) {
  EXPECT_FALSE(xy_of(Xyz{0, 0, 0}));
  EXPECT_FALSE(xy_of(Xyz{-1, 0.5, 0.5}));
  EXPECT_FALSE(xy_of(Xyz{std::numeric_limits<double>::infinity(), 1, 1}));
  EXPECT_FALSE(xyz_of(Xy{0.3, 0}));
  EXPECT_FALSE(xyz_of(Xy{0.3, -0.1}));
  EXPECT_FALSE(xyz_of(Xy{std::numeric_limits<double>::quiet_NaN(), 0.3}));
  EXPECT_FALSE(uv_prime_of({1.8, 0.05}));  // -2x + 12y + 3 = 0
}

TEST(Chromaticity, RoundTripsThroughXyzAndUv) {
  for (const double x : test::steps(0.02, 0.75, 0.05)) {
    for (const double y : test::steps(0.01, 0.85, 0.05)) {
      const Xy xy{x, y};
      const Xy by_xyz = *xy_of(*xyz_of(xy, 37.5));
      const Xy by_uv = *xy_of(*uv_prime_of(xy));
      EXPECT_NEAR(by_xyz.x, x, 1e-14);  // a few roundings of numbers below 1
      EXPECT_NEAR(by_xyz.y, y, 1e-14);
      EXPECT_NEAR(by_uv.x, x, 1e-13);
      EXPECT_NEAR(by_uv.y, y, 1e-13);
    }
  }
}

TEST(Chromaticity, UvOfD65IsThePublishedOne) {
  const UvPrime uv = *uv_prime_of(white_d65);
  EXPECT_NEAR(uv.u, 0.1978, 5e-5);  // CIE 15:2018 table T.3, four digits
  EXPECT_NEAR(uv.v, 0.4683, 5e-5);
}

TEST(RgbSpaces, MatricesAgreeWithTheStandardsRounding) {
  // IEC 61966-2-1 prints four digits.
  expect_near(*rgb_to_xyz(primaries_rec709),
              {{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}}, 6e-5);
  const Matrix3 rec2020 = *rgb_to_xyz(primaries_rec2020);
  EXPECT_NEAR(rec2020[1][0], 0.2627, 5e-5);  // BT.2020 table 4
  EXPECT_NEAR(rec2020[1][1], 0.6780, 5e-5);
  EXPECT_NEAR(rec2020[1][2], 0.0593, 5e-5);
  const Matrix3 p3 = *rgb_to_xyz(primaries_p3_d65);
  EXPECT_NEAR(p3[1][0], 0.2290, 5e-5);  // SMPTE EG 432-1 with D65
  EXPECT_NEAR(p3[1][1], 0.6917, 5e-5);
  EXPECT_NEAR(p3[1][2], 0.0793, 5e-5);
}

TEST(RgbSpaces, WhiteAndPrimariesHaveTheirChromaticities) {
  for (const RgbPrimaries& p : {primaries_rec709, primaries_p3_d65, primaries_rec2020}) {
    const Matrix3 m = *rgb_to_xyz(p);
    const Vector3 units[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
    const Xy expected[] = {p.red, p.green, p.blue, p.white};
    for (int i = 0; i < 4; ++i) {
      const Xy found = *xy_of(xyz_of(m * units[i]));
      EXPECT_NEAR(found.x, expected[i].x, 1e-14);
      EXPECT_NEAR(found.y, expected[i].y, 1e-14);
    }
    EXPECT_NEAR((m * Vector3{1, 1, 1})[1], 1, 1e-14);
  }
}

TEST(RgbSpaces, PrimariesOnOneLineHaveNoMatrix) {
  EXPECT_FALSE(rgb_to_xyz({{0.2, 0.2}, {0.3, 0.3}, {0.4, 0.4}, white_d65}));
  EXPECT_FALSE(rgb_to_xyz({{0.64, 0}, {0.3, 0.6}, {0.15, 0.06}, white_d65}));
}

TEST(BradfordAdaptation, AgreesWithThePublishedMatrixFromD65ToD50) {
  // ICC.1:2010 Annex E, as printed there; its whites are rounded to four digits.
  expect_near(*bradford_adaptation(white_d65, white_d50),
              {{{1.0478, 0.0229, -0.0501}, {0.0295, 0.9905, -0.0171}, {-0.0092, 0.0150, 0.7521}}}, 3e-4);
}

TEST(BradfordAdaptation, TakesWhiteToWhiteAndBack) {
  const Xy whites[] = {white_d50, white_d65, white_e, {0.4476, 0.4074}, {0.5217, 0.4180}};
  for (const Xy& from : whites) {
    for (const Xy& to : whites) {
      const Matrix3 there = *bradford_adaptation(from, to);
      const Vector3 white = there * vector_of(*xyz_of(from));
      const Vector3 expected = vector_of(*xyz_of(to));
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(white[i], expected[i], 1e-12);
      expect_near(*bradford_adaptation(to, from) * there, identity3(), 1e-12);
    }
  }
}

TEST(BradfordAdaptation, IsRefusedFromAWhiteOutsideTheConesReach) {
  EXPECT_FALSE(bradford_adaptation({0.7, 0.02}, white_d65));
  EXPECT_FALSE(bradford_adaptation(white_d65, {0.3, 0}));
}

TEST(Cielab, WhiteGreyAndPrimaryHaveTheirClosedFormValues) {
  const Xyz white = *xyz_of(white_d65);
  const Lab of_white = lab_of(white, white);
  EXPECT_NEAR(of_white.l, 100, 1e-12);
  EXPECT_NEAR(of_white.a, 0, 1e-12);
  EXPECT_NEAR(of_white.b, 0, 1e-12);
  // L* = 903.3 Y below Y = 0.008856 (24389/27 exactly), 116 cbrt(Y) - 16 above
  EXPECT_NEAR(lab_of(*xyz_of(white_d65, 0.004), white).l, 24389.0 / 27.0 * 0.004, 1e-10);
  EXPECT_NEAR(lab_of(*xyz_of(white_d65, 0.125), white).l, 42, 1e-12);
  EXPECT_NEAR(lab_of(*xyz_of(white_d65, -0.004), white).l, -24389.0 / 27.0 * 0.004, 1e-10);
  // The sRGB red; published as 53.24 80.09 67.20 (two digits).
  const Lab red = lab_of(xyz_of(*rgb_to_xyz(primaries_rec709) * Vector3{1, 0, 0}), white);
  EXPECT_NEAR(red.l, 53.24, 0.01);
  EXPECT_NEAR(red.a, 80.09, 0.02);
  EXPECT_NEAR(red.b, 67.20, 0.02);
}

}  // namespace
}  // namespace lowlux::isp
