#include "isp/model/colour/colorimetry.h"

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

TEST(Chromaticity, UvOfTheIlluminantsIsThePublishedOne) {
  struct Published {
    Xy xy;
    UvPrime uv;
  };
  constexpr Published illuminants[] = {// CIE 15:2018 table T.3, four digits of u'v': A, C, D50, D55, D65, D75
                                       {{0.44758, 0.40745}, {0.2560, 0.5243}}, {{0.31006, 0.31616}, {0.2009, 0.4609}},
                                       {{0.34567, 0.35851}, {0.2092, 0.4881}}, {{0.33243, 0.34744}, {0.2044, 0.4807}},
                                       {{0.31272, 0.32903}, {0.1978, 0.4683}}, {{0.29903, 0.31488}, {0.1935, 0.4585}}};
  for (const Published& light : illuminants) {
    const UvPrime uv = *uv_prime_of(light.xy);
    EXPECT_NEAR(uv.u, light.uv.u, 5.5e-5) << light.xy.x;  // half of their last digit, and what that of xy makes
    EXPECT_NEAR(uv.v, light.uv.v, 5.5e-5) << light.xy.x;
  }
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

struct ChartPatch {
  Xy xy;
  double y;
  Lab lab;
};

// The ColorChecker under D50: xyY and CIELAB as D. Pascale, "RGB coordinates of the Macbeth ColorChecker" (BabelColor,
// 2006) prints them, xyY to four digits.
constexpr ChartPatch chart_patches[] = {
    {{0.4316, 0.3777}, 0.1008, {37.986, 13.555, 14.059}},  {{0.4197, 0.3744}, 0.3495, {65.711, 18.130, 17.810}},
    {{0.2760, 0.3016}, 0.1836, {49.927, -4.880, -21.925}}, {{0.3703, 0.4499}, 0.1325, {43.139, -13.095, 21.905}},
    {{0.2999, 0.2856}, 0.2304, {55.112, 8.844, -25.399}},  {{0.2848, 0.3911}, 0.4178, {70.719, -33.397, -0.199}},
    {{0.5295, 0.4055}, 0.3118, {62.661, 36.067, 57.096}},  {{0.2305, 0.2106}, 0.1126, {40.020, 10.410, -45.964}},
    {{0.5012, 0.3273}, 0.1938, {51.124, 48.239, 16.248}},  {{0.3319, 0.2482}, 0.0637, {30.325, 22.976, -21.587}},
    {{0.3984, 0.5008}, 0.4446, {72.532, -23.709, 57.255}}, {{0.4957, 0.4427}, 0.4357, {71.941, 19.363, 67.857}},
    {{0.2018, 0.1692}, 0.0575, {28.778, 14.179, -50.297}}, {{0.3253, 0.5032}, 0.2318, {55.261, -38.342, 31.370}},
    {{0.5686, 0.3303}, 0.1257, {42.101, 53.378, 28.190}},  {{0.4697, 0.4734}, 0.5981, {81.733, 4.039, 79.819}},
    {{0.4159, 0.2688}, 0.2009, {51.935, 49.986, -14.574}}, {{0.2131, 0.3023}, 0.1930, {51.038, -28.631, -28.638}},
    {{0.3469, 0.3608}, 0.9131, {96.539, -0.425, 1.186}},   {{0.3440, 0.3584}, 0.5894, {81.257, -0.638, -0.335}},
    {{0.3432, 0.3581}, 0.3632, {66.766, -0.734, -0.504}},  {{0.3446, 0.3579}, 0.1915, {50.867, -0.153, -0.270}},
    {{0.3401, 0.3548}, 0.0883, {35.656, -0.421, -1.231}},  {{0.3406, 0.3537}, 0.0311, {20.461, -0.079, -0.973}},
};

TEST(Cielab, OfTheColorCheckerIsThePublishedOne) {
  const Xyz white = *xyz_of(white_d50);
  for (const ChartPatch& patch : chart_patches) {
    const Lab lab = lab_of(*xyz_of(patch.xy, patch.y), white);
    // Half of the fourth digit of Y is 0.03 of L*, that of xy up to 0.1 of a* and b*.
    EXPECT_NEAR(lab.l, patch.lab.l, 0.05) << patch.xy.x;
    EXPECT_NEAR(lab.a, patch.lab.a, 0.1) << patch.xy.x;
    EXPECT_NEAR(lab.b, patch.lab.b, 0.1) << patch.xy.x;
  }
}

}  // namespace
}  // namespace lowlux::isp
