#include "isp/model/appearance/shin.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "isp/model/appearance/gamut_map.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr Matrix3 srgb_to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
constexpr Xyz pixel{0.29577, 0.25656, 0.12854};  // linear sRGB 0.5 0.2 0.1
constexpr double printed = 6e-7;                 // half of the last of six digits

/// The observer of the specification's worked values: equations alone, no adaptation to the white.
ShinEye plain_eye(ShinMatrix matrix = ShinMatrix::exact) {
  return shin_eye({.white = {0.9505, 1, 1.089}, .matrix = matrix, .adaptation = ShinAdaptation::none});
}

ShinCoefficients substitute_at(double e) { return shin_coefficients(shin_substitute(), e); }

void expect_near(const Vector3& found, const Vector3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << "component " << i;
}

Vector3 of(const OpponentSignals& s) { return {s.a, s.rg, s.by}; }

TEST(ShinSubstitute, HasItsCheckValues) {
  struct Row {
    double e, alpha, beta, l, m;
  };
  for (const Row& row : {Row{0.01, 0.185634, 0.814366, 0.1, 0.1},
                         {0.1, 0.480425, 0.519575, 0.1, 0.1},
                         {1, 0.784125, 0.215875, 0.325, 0.1},
                         {2, 0.876803, 0.123197, 0.392732, 0.190309},
                         {5, 1, 0, 0.482268, 0.309691},
                         {10, 1, 0, 0.55, 0.4},
                         {100, 1, 0, 0.775, 0.7},
                         {250, 1, 0, 0.864537, 0.819382},
                         {1000, 1, 0, 1, 1}}) {
    const ShinCoefficients c = substitute_at(row.e);
    EXPECT_NEAR(c.alpha, row.alpha, printed);
    EXPECT_NEAR(c.beta, row.beta, printed);
    EXPECT_NEAR(c.l, row.l, printed);
    EXPECT_NEAR(c.m, row.m, printed);
    EXPECT_EQ(c.a, 0);
    EXPECT_EQ(c.b, 0);
  }
  EXPECT_EQ(shin_substitute().name, "SHIN-SUB-1");
}

TEST(ShinTable, IsReadAndLinearInTheLogarithm) {
  const auto table = read_shin_table(
      "# from a paper\n"
      "E alpha beta l a m b\n"
      "0.01, 0.2, 0.8, 0.1, 0.01, 0.2, 0.02\r\n"
      "\n"
      "1 0.6 0.4 0.3 0 0.4 0  # by blanks\n"
      "1000,1,0,1,0,1,0",
      "Table 1");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->name, "Table 1");
  ASSERT_EQ(table->nodes.size(), 3u);
  const ShinCoefficients c = shin_coefficients(*table, 0.1);
  EXPECT_NEAR(c.alpha, 0.4, 1e-15);
  EXPECT_NEAR(c.beta, 0.6, 1e-15);
  EXPECT_NEAR(c.l, 0.2, 1e-15);
  EXPECT_NEAR(c.a, 0.005, 1e-15);
  EXPECT_NEAR(c.m, 0.3, 1e-15);
  EXPECT_NEAR(c.b, 0.01, 1e-15);
  EXPECT_EQ(shin_coefficients(*table, 1).l, 0.3) << "a node";
  EXPECT_EQ(shin_coefficients(*table, 1e-9).alpha, 0.2) << "below the first";
  EXPECT_EQ(shin_coefficients(*table, 1e9).l, 1) << "above the last";
}

TEST(ShinTable, RefusesWhatIsNoTableAndSaysWhere) {
  struct Case {
    std::string text, says;
  };
  for (const Case& bad : {Case{"", "at least two"},
                          {"1 1 0 1 0 1 0", "found 1"},
                          {"1 1 0 1 0 1\n2 1 0 1 0 1 0", "line 1"},
                          {"1 1 0 1 0 1 0\n2 1 0 1 0 1 0 7", "line 2 of the coefficients: expected E"},
                          {"1 1 0 1 0 1 0\n2 1 0 x 0 1 0", "found \"x\""},
                          {"1 1 0 1 0 1 0\n2 1 0 nan 0 1 0", "finite"},
                          {"1 1 0 1 0 1 0\n2 1 0 1e999 0 1 0", "finite"},
                          {"2 1 0 1 0 1 0\n1 1 0 1 0 1 0", "rise"},
                          {"1 1 0 1 0 1 0\n1 1 0 1 0 1 0", "rise"},
                          {"0 1 0 1 0 1 0\n1 1 0 1 0 1 0", "positive"},
                          {"e a b l a m b\ne a b l a m b\n1 1 0 1 0 1 0", "line 2"}}) {
    const auto table = read_shin_table(bad.text, "t");
    ASSERT_FALSE(table) << bad.text;
    EXPECT_EQ(table.error().code, ErrorCode::malformed);
    EXPECT_NE(table.error().message.find(bad.says), std::string::npos) << table.error().message;
  }
  std::string many;
  for (int i = 1; i <= 1001; ++i) many += std::to_string(i) + " 1 0 1 0 1 0\n";
  EXPECT_EQ(read_shin_table(many, "t").error().code, ErrorCode::too_large);
}

TEST(ShinModel, ForwardHasItsCheckValues) {
  struct Row {
    double e;
    Vector3 signals, rgb;
  };
  const ShinEye eye = plain_eye();
  const Matrix3 to_srgb = *inverse(srgb_to_xyz);
  for (const Row& row : {Row{1000, {0.256560, 0.029624, 0.128020}, {0.500000, 0.200000, 0.100000}},
                         {250, {0.256560, 0.025611, 0.104897}, {0.476457, 0.204552, 0.124234}},
                         {10, {0.256560, 0.016293, 0.051208}, {0.421792, 0.215121, 0.180504}},
                         {2, {0.248167, 0.011634, 0.024363}, {0.384055, 0.212533, 0.201007}},
                         {0.1, {0.221162, 0.002962, 0.012802}, {0.292355, 0.203369, 0.187770}},
                         {0.01, {0.201078, 0.002962, 0.012802}, {0.267459, 0.184532, 0.169508}}}) {
    const OpponentSignals signals = shin_forward(pixel, substitute_at(row.e), eye);
    expect_near(of(signals), row.signals, printed);
    expect_near(to_srgb * vector_of(shin_daylight(signals, eye)), row.rgb, 2e-6);  // sRGB of the pixel to six digits
  }
  EXPECT_NEAR(eye.white_scotopic, 2.45699, 6e-6);
  EXPECT_NEAR(scotopic_luminance(pixel), 0.385738, printed);
}

TEST(ShinModel, PublishedMatricesLoseSomeX) {
  const ShinEye eye = plain_eye(ShinMatrix::published);
  const Xyz white = shin_daylight(shin_forward({0.9505, 1, 1.089}, ShinCoefficients{}, eye), eye);
  EXPECT_NEAR(white.x, 0.94772, 6e-6);
  EXPECT_NEAR(white.y, 1, 1e-12);
  EXPECT_NEAR(white.z, 1.089, 1e-12);
}

TEST(ShinModel, WhiteHasNoColourOnlyOnceAdaptedTo) {
  const OpponentSignals plain = shin_forward({0.9505, 1, 1.089}, ShinCoefficients{}, plain_eye());
  EXPECT_NEAR(plain.rg, -0.0368, 6e-5);
  EXPECT_NEAR(plain.by, -0.0890, 6e-5);
  const ShinEye adapted = shin_eye({.white = {1.1, 1, 0.35}});
  const OpponentSignals white = shin_forward({1.1, 1, 0.35}, substitute_at(0.3), adapted);
  EXPECT_NEAR(white.rg, 0, 1e-15);
  EXPECT_NEAR(white.by, 0, 1e-15);
  const Xyz seen = shin_daylight(white, adapted);
  EXPECT_NEAR(seen.x / seen.y, 1.1, 1e-12);
  EXPECT_NEAR(seen.z / seen.y, 0.35, 1e-12);
}

TEST(ShinModel, LevelIsInLuxOrAsItStands) {
  EXPECT_NEAR(shin_level(250, ShinUnits::lux), 873, 0.5);
  EXPECT_NEAR(shin_level(2, ShinUnits::lux), 7, 0.05);
  EXPECT_EQ(shin_level(2, ShinUnits::luminance_as_is), 2);
}

TEST(ShinInverse, HasTheCheckValuesOfRetargeting) {
  const ShinEye eye = plain_eye();
  const OpponentSignals target = shin_forward(pixel, substitute_at(250), eye);
  const Matrix3 to_srgb = *inverse(srgb_to_xyz);

  const ShinInverse published = shin_inverse_published(target, substitute_at(2), eye, scotopic_luminance(pixel));
  expect_near(vector_of(published.colour), {0.291884, 0.266133, -0.285062}, printed);
  expect_near(to_srgb * vector_of(published.colour), {0.678927, 0.204549, -0.339345}, printed);
  EXPECT_NEAR(shin_forward(published.colour, substitute_at(2), eye).a, 0.233346, printed) << "9 % too dark";

  const ShinInverse own = shin_inverse(target, substitute_at(2), eye);
  expect_near(vector_of(own.colour), {0.316109, 0.290100, -0.261095}, printed);
  expect_near(to_srgb * vector_of(own.colour), {0.708637, 0.227028, -0.317552}, printed);
  EXPECT_TRUE(own.exact);
  expect_near(of(shin_forward(own.colour, substitute_at(2), eye)), of(target), 1e-12);
}

TEST(ShinInverse, UndoesForwardWhereverItExists) {
  const auto table = read_shin_table("0.01 0.2 0.8 0.1 0.02 0.2 -0.01\n1000 1 0 1 0 1 0", "t").value();
  for (const ShinTable* coefficients : {&shin_substitute(), &table}) {
    for (const double e : {0.01, 0.3, 2.0, 100.0, 1000.0}) {
      for (const ShinAdaptation adaptation : {ShinAdaptation::none, ShinAdaptation::to_white}) {
        const ShinEye eye = shin_eye({.white = {0.9505, 1, 1.089}, .adaptation = adaptation});
        const ShinCoefficients c = shin_coefficients(*coefficients, e);
        for (const Vector3& rgb :
             {Vector3{1, 1, 1}, {0.5, 0.2, 0.1}, {0, 0, 1}, {1, 0, 0}, {1e-6, 2e-6, 1e-6}, {0, 0, 0}}) {
          const Vector3 xyz = srgb_to_xyz * rgb;
          const OpponentSignals signals = shin_forward(xyz_of(xyz), c, eye);
          const ShinInverse back = shin_inverse(signals, c, eye);
          expect_near(vector_of(back.colour), xyz, 1e-9);
          EXPECT_TRUE(back.exact) << e;
          const ShinInverse published = shin_inverse_published(signals, c, eye, scotopic_luminance(xyz_of(xyz)));
          expect_near(vector_of(published.colour), xyz, 1e-12);
        }
      }
    }
  }
}

TEST(ShinInverse, IsBoundedWhereThereIsNone) {
  const ShinEye eye = plain_eye();
  const ShinCoefficients blind{.alpha = 0, .beta = 1, .l = 0, .a = 0, .m = 0, .b = 0};
  const ShinInverse floored = shin_inverse({0.5, 0.1, 0.1}, blind, eye);
  EXPECT_FALSE(floored.exact);
  for (const double value : vector_of(floored.colour)) EXPECT_LT(std::fabs(value), 100);

  const ShinInverse too_dark = shin_inverse_published({0.01, 0, 0}, substitute_at(0.01), eye, 2.0);
  EXPECT_FALSE(too_dark.exact) << "rods alone give more than was asked for";
  EXPECT_NEAR(too_dark.colour.y, 0, 1e-15);
  EXPECT_FALSE(shin_inverse({-0.5, 0, 0}, substitute_at(1), eye).exact);

  const ShinCoefficients runaway{.alpha = 1, .beta = 0, .l = 0.1, .a = 5, .m = 0.1, .b = 5};
  const ShinInverse none = shin_inverse({0.5, 0, 0}, runaway, eye);
  EXPECT_FALSE(none.exact) << "more rods ask for still more";
  for (const double value : vector_of(none.colour)) EXPECT_TRUE(std::isfinite(value));
}

TEST(GamutMap, KeepsLuminanceAndAsMuchColourAsFits) {
  constexpr Vector3 w{0.2126, 0.7152, 0.0722};
  const auto luminance = [&](const Vector3& v) { return w[0] * v[0] + w[1] * v[1] + w[2] * v[2]; };
  const Vector3 within{0.2, 0.5, 0.9};
  EXPECT_EQ(toward_white(within, w).kept, 1);
  expect_near(toward_white(within, w).rgb, within, 1e-15);

  for (const Vector3& outside : {Vector3{0.708637, 0.227028, -0.317552}, {1.4, 0.6, 0.3}, {1.5, 0.5, -0.5}}) {
    const GamutMapped mapped = toward_white(outside, w);
    const double y = luminance(outside), least = std::ranges::min(mapped.rgb), most = std::ranges::max(mapped.rgb);
    EXPECT_NEAR(luminance(mapped.rgb), y, 1e-15);
    EXPECT_TRUE(least >= 0 && most <= 1);
    EXPECT_TRUE(least < 1e-15 || most > 1 - 1e-15) << "the largest t ends at a wall";
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(mapped.rgb[i] - y, mapped.kept * (outside[i] - y), 1e-15);
  }
  expect_near(toward_white({2, 2, 0.1}, w).rgb, {1, 1, 1}, 0);
  EXPECT_EQ(toward_white({2, 2, 0.1}, w).kept, 0);
  expect_near(toward_white({-1, 0, 0.1}, w).rgb, {}, 0);
  expect_near(toward_white({0, 0, 0}, w).rgb, {}, 0);
}

}  // namespace
}  // namespace lowlux::isp
