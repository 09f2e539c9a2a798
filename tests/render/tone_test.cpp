#include "isp/render/tone.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "isp/render/output_space.h"
#include "tests/support/sweep.h"

namespace lowlux::isp::tone_test {
namespace {

std::vector<double> limits() {
  std::vector<double> all;
  for (const double log2_limit : test::steps(0, 12, 0.25)) all.push_back(std::exp2(log2_limit));
  return all;
}

double standard(double x, double limit) { return apply_tone(ToneCurve::standard, x, limit); }

TEST(ToneLimit, IsWhereTheSensorSaturatesButNotBelowWhite) {
  EXPECT_EQ(tone_limit(ToneCurve::standard, 3), 8);
  EXPECT_EQ(tone_limit(ToneCurve::standard, 0), 1);
  EXPECT_EQ(tone_limit(ToneCurve::standard, -2), 1);
  EXPECT_EQ(tone_limit(ToneCurve::standard, 40), max_tone_limit);
  EXPECT_EQ(tone_limit(ToneCurve::none, 3), 1);
}

TEST(NoneTone, IsTheIdentityUpToWhite) {
  for (const double x : {-0.5, 0.0, 1e-9, 0.18, 0.999, 1.0}) EXPECT_EQ(apply_tone(ToneCurve::none, x, 1), x);
  EXPECT_EQ(apply_tone(ToneCurve::none, 1.5, 1), 1);
}

TEST(StandardTone, KeepsBlackMidGreyAndTheLimitForEveryLimit) {
  for (const double limit : limits()) {
    EXPECT_EQ(standard(0, limit), 0);
    EXPECT_NEAR(standard(0.18, limit), 0.18, 1e-15);
    EXPECT_EQ(standard(limit, limit), 1);
    EXPECT_NEAR(standard(limit * (1 - 1e-9), limit), 1, 2e-9);  // no step at the limit
    EXPECT_EQ(standard(2 * limit, limit), 1);
  }
}

TEST(StandardTone, RisesStrictlyAndWithoutAKinkForEveryLimit) {
  for (const double limit : limits()) {
    double x_before = -0.01, before = standard(x_before, limit), slope_before = 0.7;
    for (int i = 1; i <= 4000; ++i) {
      const double x =
          -0.01 + 0.02 * std::expm1(i / 4000.0 * std::log1p(limit / 0.02));  // even steps, then even ratios
      const double y = standard(x, limit);
      ASSERT_GT(y, before) << "limit " << limit << " x " << x;
      const double slope = (y - before) / (x - x_before);
      // The curvature is below 3.4 (parabola: 2 (1 - s) / m), so neighbouring chords differ by no more than that times
      // dx.
      ASSERT_LT(std::fabs(slope - slope_before), 3.4 * (x - x_before) + 1e-6) << "limit " << limit << " x " << x;
      before = y, slope_before = slope, x_before = x;
    }
  }
}

TEST(StandardTone, HasTheStatedSlopesAndDoesNotAmplifyNoiseAroundBlack) {
  constexpr double h = 1e-6;
  for (const double limit : limits()) {
    EXPECT_NEAR((standard(h, limit) - standard(-h, limit)) / (2 * h), 0.7, 1e-5);
    EXPECT_NEAR((standard(0.18, limit) - standard(0.18 - h, limit)) / h, 1.3, 1e-5);
    EXPECT_NEAR((standard(0.18 + h, limit) - standard(0.18, limit)) / h, 1.3, 1e-5);
    EXPECT_NEAR(standard(-0.01, limit), -0.007, 1e-15);  // not rectified
  }
}

TEST(StandardTone, MoreExposureNeverDarkensAnything) {
  for (const double scene : {0.0001, 0.003, 0.05, 0.18, 0.5, 0.9, 1.0}) {
    double before = 0;
    for (const double ev : test::steps(0, 12, 0.05)) {
      const double y = standard(scene * std::exp2(ev), tone_limit(ToneCurve::standard, ev));
      EXPECT_GE(y, before - 1e-15) << scene << " " << ev;
      before = y;
    }
  }
}

TEST(StandardTone, ShowsADiffuseWhiteAsItsCommentSays) {
  EXPECT_NEAR(standard(0.9, 1), 0.92, 0.01);
  EXPECT_NEAR(standard(0.9, 1000), 0.73, 0.01);
}

std::vector<ToneShape> shapes() {
  std::vector<ToneShape> all;
  for (const double brightness_ev : {-1.0, -0.3, 0.0, 1.0, 2.0}) {
    for (const double contrast : {0.5, 0.8, 1.0, 1.25, 1.5}) all.push_back({brightness_ev, contrast});
  }
  return all;
}

TEST(ToneShape, OfTheDefaultIsTheStandardCurveBitForBit) {
  for (const double limit : limits()) {
    for (const double x : {-0.01, 0.0, 0.003, 0.1, 0.18, 0.19, 0.5, 0.9 * limit}) {
      EXPECT_EQ(apply_tone(ToneCurve::standard, x, limit, {0, 1}), standard(x, limit));
    }
  }
}

TEST(ToneShape, KeepsBlackAndWhiteMovesMidGreyAndChangesTheSlopeThereAsStated) {
  constexpr double h = 1e-7;
  for (const ToneShape& shape : shapes()) {
    const double gain = std::exp2(shape.brightness_ev);
    for (const double limit : {1.0, 1.5, 8.0, 4096.0}) {
      const auto tone = [&](double x) { return apply_tone(ToneCurve::standard, x, limit, shape); };
      EXPECT_EQ(tone(0), 0);
      EXPECT_EQ(tone(limit), 1);
      EXPECT_NEAR(tone(limit * (1 - 1e-9)), 1, 1e-7);  // no step at the limit; the slope is below 30
      EXPECT_NEAR(tone(0.18), 0.18 * gain, 1e-12);
      EXPECT_NEAR((tone(0.18) - tone(0.18 - h)) / h, 1.3 * shape.contrast * gain, 1e-4);
      EXPECT_NEAR((tone(0.18 + h) - tone(0.18)) / h, 1.3 * shape.contrast * gain, 1e-2);     // t^1.5 in the shoulder
      EXPECT_NEAR((tone(h) - tone(-h)) / (2 * h), (2 - 1.3 * shape.contrast) * gain, 1e-4);  // not rectified
      double before = tone(-0.01);
      for (int i = 1; i <= 2000; ++i) {
        const double y = tone(-0.01 + 0.02 * std::expm1(i / 2000.0 * std::log1p((limit + 0.01) / 0.02)));
        ASSERT_GE(y, before) << shape.brightness_ev << " " << shape.contrast << " " << limit;
        before = y;
      }
    }
  }
}

struct TableErrors {
  double code8 = 0;   // of 255
  double code16 = 0;  // of 65535
};

/// How a kernel interpolates: linear between the edges of the bin.
double interpolated(const ToneTable& table, float v) {
  const int bin = table.bin_of(v);
  const auto edge = [&](int i) {
    return std::bit_cast<float>(table.base_bits() + (static_cast<std::uint32_t>(i) << table.shift));
  };
  const double t =
      (static_cast<double>(v + table.offset) - edge(bin)) / (static_cast<double>(edge(bin + 1)) - edge(bin));
  return table.edge[bin] + t * (table.edge[bin + 1] - table.edge[bin]);
}

TableErrors errors_of(ToneCurve curve, OutputSpace space, double limit, const ToneShape& shape = {}) {
  const ToneTable table = make_tone_table(curve, space, limit, shape);
  TableErrors worst;
  for (int i = 0; i <= 30000; ++i) {
    const double t = i / 30000.0;
    const auto v = static_cast<float>(t * t * t);  // dense in the shadows
    const double exact = encode_transfer(space, apply_tone(curve, v * limit, limit, shape));
    worst.code8 = std::fmax(worst.code8, std::fabs(table.code8[table.bin_of(v)] - 255 * exact));
    worst.code16 = std::fmax(worst.code16, 65535 * std::fabs(interpolated(table, v) - exact));
  }
  return worst;
}

struct StatedErrors {
  double from_limit_log2, to_limit_log2;
  double code8, code8_linear, code16;
};

// tone.h, make_tone_table: half a code of rounding plus half a bin of slope.
constexpr StatedErrors stated_errors[] = {
    {0, 1.4, 0.6, 0.7, 0.2}, {1.5, 9.4, 0.7, 0.75, 0.2}, {9.5, 12, 0.8, 0.9, 0.5}};

TEST(ToneTable, ErrorsAreAsStatedForEverySpaceAndLimit) {
  for (const NamedOutputSpace& known : output_spaces) {
    for (const StatedErrors& stated : stated_errors) {
      TableErrors worst;
      for (const double log2_limit : test::steps(stated.from_limit_log2, stated.to_limit_log2, 0.2)) {
        const TableErrors found = errors_of(ToneCurve::standard, known.space, std::exp2(log2_limit));
        worst = {std::fmax(worst.code8, found.code8), std::fmax(worst.code16, found.code16)};
      }
      std::printf("  %-15s limits to 2^%-4g code8 %.3f, 16 bit %.3f\n", std::string(known.name).c_str(),
                  stated.to_limit_log2, worst.code8, worst.code16);
      EXPECT_LE(worst.code8, is_linear(known.space) ? stated.code8_linear : stated.code8) << known.name;
      EXPECT_LE(worst.code16, stated.code16) << known.name;
    }
    const TableErrors none = errors_of(ToneCurve::none, known.space, 1);
    EXPECT_LE(none.code8, is_linear(known.space) ? stated_errors[0].code8_linear : stated_errors[0].code8);
    EXPECT_LE(none.code16, stated_errors[0].code16) << known.name;
  }
}

TEST(ToneTable, ErrorsOfShapesAreThoseOfTheStandardCurveTimesTheirSlope) {
  for (const ToneShape& shape : shapes()) {
    for (const double limit : {1.0, 2.0, 500.0}) {
      const TableErrors found = errors_of(ToneCurve::standard, OutputSpace::srgb, limit, shape);
      // Half a code of rounding and half a bin of a slope that is up to 1.5 * 4 times as steep: 0.5 + 6 * 0.2.
      EXPECT_LE(found.code8, 1.7) << shape.brightness_ev << " " << shape.contrast << " " << limit;
      EXPECT_LE(found.code16, 3) << shape.brightness_ev << " " << shape.contrast << " " << limit;
    }
  }
}

TEST(ToneTable, EndsAreExactAndTheTableRises) {
  for (const double limit : limits()) {
    for (const OutputSpace space : {OutputSpace::srgb, OutputSpace::rec2020, OutputSpace::linear_srgb}) {
      const ToneTable table = make_tone_table(ToneCurve::standard, space, limit);
      EXPECT_LE(table.bins, ToneTable::capacity);
      EXPECT_GT(table.bins, ToneTable::capacity / 3) << limit;
      EXPECT_EQ(table.bin_of(0), 0);
      EXPECT_EQ(table.bin_of(1), table.bins - 1);
      EXPECT_EQ(table.code8[0], 0);
      EXPECT_EQ(table.edge[0], 0);
      EXPECT_EQ(table.code8[table.bins - 1], 255);
      EXPECT_NEAR(interpolated(table, 1), 1, 1e-7);  // one rounding to float
      EXPECT_LE(65535 * interpolated(table, std::nextafter(1.0f, 0.0f)), 65535.01);
      for (int bin = 0; bin < table.bins; ++bin) {
        ASSERT_LE(table.edge[bin], table.edge[bin + 1]) << limit << " " << bin;  // near white two may round alike
        ASSERT_GE(table.code8[bin], table.code8[bin > 0 ? bin - 1 : 0]) << limit << " " << bin;
      }
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::tone_test
