#include "isp/render/retarget/luminance_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "isp/model/vision/seeing.h"

namespace lowlux::isp {
namespace {

LuminanceCurve curve_for(double source, double display, double black = 0) {
  const auto curve = luminance_curve({source, display, black});
  EXPECT_TRUE(curve) << curve.error().message;
  return curve.value_or(LuminanceCurve{});
}

TEST(ContrastSensitivity, HasTheThresholdItIsScaledTo) {
  EXPECT_NEAR(threshold_contrast(100), 0.0041, 1e-15);
  double before = 1;
  for (int tenths = -80; tenths <= 50; ++tenths) {
    const double log = 0.1 * tenths;
    const double now = threshold_contrast(std::pow(10.0, log));
    EXPECT_LE(now, before) << log;
    EXPECT_LE(now, 0.999);
    before = now;
  }
  for (const double dark : {0.0, -1.0, 1e-300, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(threshold_contrast(dark), 0.999) << dark;
  }
  EXPECT_NEAR(threshold_log_contrast(100), 0.0041 / std::log(10.0), 1e-7) << "artanh(M) / ln 10, M^3 / 3 left out";
  EXPECT_LT(threshold_contrast(std::numeric_limits<double>::infinity()), 0.0041);
}

TEST(ContrastSensitivity, IsBartensFormula) {
  // exp(-0.0016 * 4 * 2^0.08) = 0.993258; (1 + 1.44 + 2.56) = 5; 63 / 100^0.83 = 1.378333; 1 / (1 - exp(-0.08)) =
  // 13.006666; 5200 * 0.993258 / sqrt(5 * 14.384999) = 609.01
  EXPECT_NEAR(barten_sensitivity(2, 100, 10), 609.01, 0.2);
}

TEST(LuminanceCurve, EqualDisplaysChangeNothing) {
  const LuminanceCurve curve = curve_for(250, 250);
  EXPECT_LT(luminance_curve_cost(curve), 1e-20);
  for (const double y : {0.0, 0.01, 0.08, 1.0, 33.0, 250.0}) {
    EXPECT_NEAR(retargeted_luminance(curve, y), y, 1e-12 + 1e-9 * y) << "rounding of powers of ten";
  }
}

TEST(LuminanceCurve, RisesAndKeepsWithinTheDisplay) {
  for (const double black : {0.0, 0.02}) {
    const LuminanceCurve curve = curve_for(250, 2, black);
    double before = -1, y = 0;
    while (y <= 300) {
      const double shown = retargeted_luminance(curve, y);
      EXPECT_GE(shown, before - 1e-12) << y;
      EXPECT_GE(shown, black * (1 - 1e-12)) << y;
      EXPECT_LE(shown, 2 * (1 + 1e-12)) << y;
      before = shown;
      y = y * 1.05 + 1e-4;
    }
    EXPECT_EQ(retargeted_luminance(curve, 0), black);
    EXPECT_NEAR(retargeted_luminance(curve, 250), 2, 0.02) << "the display's white is used";
  }
}

TEST(LuminanceCurve, NoFeasibleChangeMakesItBetter) {
  for (const double black : {0.0, 0.05}) {
    const LuminanceCurve best = curve_for(250, 2, black);
    const double cost = luminance_curve_cost(best);
    const double low = black > 0 ? std::log10(black) : -9, high = std::log10(2.0);
    std::mt19937 draw(4);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 2000; ++i) {
      LuminanceCurve other = best;
      const double size = std::pow(10.0, -4.0 * (i % 100) / 100 - 0.5);
      const bool smooth = i % 2 == 0;
      const double shift = normal(draw), tilt = normal(draw);
      for (std::size_t k = 0; k < other.shown_log.size(); ++k) {
        const double place = static_cast<double>(k) / LuminanceCurve::segments;
        other.shown_log[k] += size * (smooth ? shift + tilt * place : normal(draw));
      }
      double floor = low;
      for (double& value : other.shown_log) floor = value = std::clamp(value, floor, high);
      // Nodes are found to 1e-5 of a decade, about which the cost is flat: twice that squared, times its curvature
      // of 2 (0.4 / 0.11)^2 per segment, is 1e-7 in all.
      EXPECT_GE(luminance_curve_cost(other), cost - 1e-7) << i;
    }
  }
}

TEST(LuminanceCurve, RefusesWhatIsNoDisplay) {
  EXPECT_FALSE(luminance_curve({0, 2, 0}));
  EXPECT_FALSE(luminance_curve({250, -1, 0}));
  EXPECT_FALSE(luminance_curve({250, std::numeric_limits<double>::infinity(), 0}));
  EXPECT_FALSE(luminance_curve({250, 2, 2}));
  EXPECT_FALSE(luminance_curve({250, 2, std::numeric_limits<double>::quiet_NaN()}));
}

}  // namespace
}  // namespace lowlux::isp
