#include "isp/model/colour/dark_desaturation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

using Exact = boost::multiprecision::cpp_bin_float_100;
constexpr double eps = std::numeric_limits<double>::epsilon();

const Xyz dark{5.1, 5.6, 6.9};

Xyz sum(const Xyz& a, const Xyz& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

Exact exact_sum(const Xyz& v) { return Exact(v.x) + Exact(v.y) + Exact(v.z); }

TEST(SignalShare, IsOneWithoutDarkHalfAtEqualSumsAndNoneWithoutSignal) {
  EXPECT_EQ(signal_fraction({1, 2, 3}, {0, 0, 0}), 1.0);
  EXPECT_EQ(signal_fraction({1, 2, 3}, {3, 2, 1}), 0.5);
  EXPECT_FALSE(signal_fraction({0, 0, 0}, dark));
  EXPECT_FALSE(signal_fraction({1, -2, 0.5}, dark));       // noise: a negative sum
  EXPECT_FALSE(signal_fraction({1, 1, 1}, {-2, -2, -2}));  // the whole sum is negative
  EXPECT_FALSE(signal_fraction({nan, 1, 1}, dark));
  EXPECT_FALSE(signal_fraction({1, 1, 1}, {inf, 1, 1}));
}

TEST(SignalShare, KeepsItsDigitsWhereTheSignalVanishes) {
  for (const double level : test::steps(-300, 5, 5)) {
    const double f = std::pow(10.0, level);
    const Xyz signal{0.7 * f, 0.4 * f, 0.1 * f};
    const Exact truth = exact_sum(signal) / (exact_sum(signal) + exact_sum(dark));
    const double relative = static_cast<double>(abs(Exact(*signal_fraction(signal, dark)) / truth - 1));
    EXPECT_LT(relative, 4 * eps) << level;  // two sums of positive terms and a quotient
  }
}

TEST(DarkDesaturation, MeasuredTrueAndDarkChromaticityAreCollinear) {
  for (const double level : test::steps(-8, 4, 0.5)) {
    const double f = std::pow(10.0, level);
    const Xyz signal{0.7 * f, 0.4 * f, 0.1 * f};
    const Xy measured = *xy_of(sum(signal, dark));
    const Xy predicted = desaturated(*xy_of(signal), *xy_of(dark), *signal_fraction(signal, dark));
    EXPECT_NEAR(measured.x, predicted.x, 4 * eps);  // of numbers below 1
    EXPECT_NEAR(measured.y, predicted.y, 4 * eps);
  }
  EXPECT_EQ(desaturated({0.6, 0.3}, {0.3, 0.3}, 0), (Xy{0.3, 0.3}));
  EXPECT_EQ(desaturated({0.6, 0.3}, {0.3, 0.3}, 1), (Xy{0.6, 0.3}));
}

TEST(DarkDesaturation, UndoRestoresTheTruthOfExactMeansAsFarAsAlphaAllows) {
  const Xy truth{0.6, 0.3}, black{0.31, 0.33};
  for (const double level : test::steps(-14, 0, 0.5)) {
    const double alpha = std::pow(10.0, level);
    const Xy measured = desaturated(truth, black, alpha);
    const Xy restored = *resaturated(measured, black, alpha);
    // What the rounding of `measured` (a few eps of 0.6) becomes, divided by alpha.
    EXPECT_NEAR(restored.x, truth.x, 4 * eps * 0.6 / alpha) << alpha;
    EXPECT_NEAR(restored.y, truth.y, 4 * eps * 0.6 / alpha) << alpha;
  }
}

TEST(DarkDesaturation, UndoItselfLosesNothingNearAlphaZero) {
  const Xy black{0.31, 0.33}, measured{0.31 + 3e-12, 0.33 - 1e-12};
  for (const double alpha : {1e-11, 1e-8, 1e-3, 0.5, 1.0}) {
    const Xy found = *resaturated(measured, black, alpha);
    const Exact x = (Exact(measured.x) - (1 - Exact(alpha)) * Exact(black.x)) / Exact(alpha);
    const Exact y = (Exact(measured.y) - (1 - Exact(alpha)) * Exact(black.y)) / Exact(alpha);
    EXPECT_LT(static_cast<double>(abs(Exact(found.x) / x - 1)), 4 * eps) << alpha;
    EXPECT_LT(static_cast<double>(abs(Exact(found.y) / y - 1)), 4 * eps) << alpha;
  }
}

TEST(DarkDesaturation, BothFormsOfTheUndoAgreeOnMeans) {
  for (const double level : test::steps(-6, 4, 0.5)) {
    const double f = std::pow(10.0, level);
    const Xyz signal{0.7 * f, 0.4 * f, 0.1 * f};
    const Xyz measured = sum(signal, dark);
    const double alpha = *signal_fraction(signal, dark);
    const Xy by_vector = *resaturated(measured, dark);
    const Xy by_chromaticity = *resaturated(*xy_of(measured), *xy_of(dark), alpha);
    EXPECT_NEAR(by_vector.x, by_chromaticity.x, 16 * eps / alpha) << level;  // both subtract near-equal numbers
    EXPECT_NEAR(by_vector.y, by_chromaticity.y, 16 * eps / alpha) << level;
  }
}

TEST(DarkDesaturation, DarkAloneDoesNotDetermineTheLight) {
  EXPECT_FALSE(resaturated(Xy{0.31, 0.33}, {0.31, 0.33}, 0));
  EXPECT_FALSE(resaturated(Xy{0.4, 0.33}, {0.31, 0.33}, 0));
  EXPECT_FALSE(resaturated(Xy{0.4, 0.33}, {0.31, 0.33}, -0.1));
  EXPECT_FALSE(resaturated(Xy{0.4, 0.33}, {0.31, 0.33}, nan));
  EXPECT_FALSE(resaturated(Xy{0.4, 0.33}, {0.31, 0.33}, 1e-320));  // the quotient is beyond double
  EXPECT_FALSE(resaturated(Xy{nan, 0.33}, {0.31, 0.33}, 0.5));
  EXPECT_FALSE(resaturated(dark, dark));
  EXPECT_FALSE(resaturated(Xyz{5, 5, 5}, dark));
}

}  // namespace
}  // namespace lowlux::isp
