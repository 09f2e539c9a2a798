#include "calib/picture/noise_line.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "calib/picture/flat_samples.h"

namespace lowlux::calib {
namespace {

constexpr ClipRange wide{-1e6, 1e6};

TEST(FitNoiseLine, GivesBackAnExactLine) {
  std::vector<NoisePoint> points;
  for (const double mean : {0.0, 10.0, 50.0, 200.0}) points.push_back({mean, 0.7 * mean + 5, 1000, wide});
  const auto line = fit_noise_line(points);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->gain_dn_per_e.value, 0.7, 1e-6);  // the fit stops at 1e-4 standard errors
  EXPECT_NEAR(line->offset_dn2.value, 5, 1e-5);
  EXPECT_NEAR(line->reduced_chi_square, 0, 1e-6);
}

TEST(FitNoiseLine, HasErrorsAsLargeAsItsScatter) {
  std::mt19937 engine(4);
  constexpr int trials = 400;
  double square = 0;
  for (int t = 0; t < trials; ++t) {
    std::vector<NoisePoint> points;
    for (int i = 0; i < 20; ++i) {
      std::chi_squared_distribution<double> chi(600);
      points.push_back({10.0 * i, (0.7 * 10 * i + 5) * chi(engine) / 600, 600, wide});
    }
    const auto line = fit_noise_line(points);
    ASSERT_TRUE(line);
    const double pull = (line->gain_dn_per_e.value - 0.7) / line->gain_dn_per_e.standard_error;
    square += pull * pull / trials;
  }
  // 5 standard errors of a mean of squares; errors are scaled up and never down: pulls may be smaller by a fifth.
  EXPECT_LT(square, 1.05 + 5 * std::sqrt(2.0 / trials));
  EXPECT_GT(square, 0.64 - 5 * 0.64 * std::sqrt(2.0 / trials));
}

TEST(FitNoiseLine, IsNotMovedFarByATexturedPoint) {
  std::vector<NoisePoint> points;
  for (int i = 0; i < 20; ++i) points.push_back({10.0 * i, 7.0 * i + 5, 600, wide});
  points[10].variance_dn2 *= 3;
  const auto line = fit_noise_line(points);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->gain_dn_per_e.value, 0.7, 0.02 * 0.7);  // without weights it would be off by a tenth
}

/// A line with grain of so much contrast, up to 400 DN.
std::vector<NoisePoint> grained(double contrast) {
  std::vector<NoisePoint> points;
  for (int i = 0; i <= 20; ++i) {
    const double mean = 20.0 * i;
    points.push_back({mean, 0.7 * mean + 5 + contrast * std::abs(contrast) * mean * mean, 2000, wide});
  }
  return points;
}

TEST(FitNoiseLine, TakesNoGrainForAGain) {
  const auto plain = fit_noise_line(grained(0.02)), fitted = fit_noise_line(grained(0.02), 0.1);
  ASSERT_TRUE(plain && fitted);
  EXPECT_EQ(plain->contrast_squared, 0);
  EXPECT_GT(plain->gain_dn_per_e.value, 0.7 * 1.05);
  // The prior, 0.1^2, is 25 times what is there and a hundred times what the points leave open: 1 % for what it draws.
  EXPECT_NEAR(fitted->gain_dn_per_e.value, 0.7, 0.01 * 0.7);
  EXPECT_NEAR(fitted->offset_dn2.value, 5, 0.01 * 5);
  EXPECT_NEAR(fitted->contrast_squared, 4e-4, 0.05 * 4e-4);
  EXPECT_GT(fitted->gain_dn_per_e.standard_error, plain->gain_dn_per_e.standard_error);
}

TEST(FitNoiseLine, ExpectsSmallContrastsMoreThanLargeOnes) {
  const auto wary = fit_noise_line(grained(0.02), 0.005), open = fit_noise_line(grained(0.02), 0.1);
  ASSERT_TRUE(wary && open);
  EXPECT_GT(wary->contrast_squared, 0);
  EXPECT_LT(wary->contrast_squared, 0.9 * open->contrast_squared);
  EXPECT_LT(wary->gain_dn_per_e.standard_error, open->gain_dn_per_e.standard_error);
}

TEST(FitNoiseLine, HasNoContrastBelowZero) {  // a variance that bends down: the line is that without contrast
  const auto plain = fit_noise_line(grained(-0.02)), fitted = fit_noise_line(grained(-0.02), 0.1);
  ASSERT_TRUE(plain && fitted);
  EXPECT_EQ(fitted->contrast_squared, 0);
  EXPECT_NEAR(fitted->gain_dn_per_e.value, plain->gain_dn_per_e.value, 1e-3 * 0.7);  // a tenth of a standard error
}

TEST(FitNoiseLine, RefusesPointsThatDoNotTellGainFromOffset) {
  EXPECT_FALSE(fit_noise_line({}));
  const std::vector<NoisePoint> two{{1, 2, 100, wide}, {2, 3, 100, wide}};
  EXPECT_FALSE(fit_noise_line(two));
  const std::vector<NoisePoint> one_mean(5, {10, 5, 100, wide});
  EXPECT_FALSE(fit_noise_line(one_mean));
}

TEST(ReadVariance, OfPixelsAtBlackIsThatOfHalfANormalLaw) {
  NoiseLine line;
  line.offset_dn2.value = 400;  // 20 DN: quantisation does not matter
  const double pi = 3.14159265358979;
  const double mean = 20 / std::sqrt(2 * pi);
  EXPECT_NEAR(read_variance_dn2(line, mean, {0, 1e6}), 400 * (0.5 - 0.5 / pi), 0.1);  // 1/12 of half the pixels
  EXPECT_NEAR(clipped_fraction(line, mean, {0, 1e6}), 0.5, 1e-6);
  EXPECT_EQ(clipped_fraction(line, mean, wide), 0);
  EXPECT_EQ(read_variance_dn2(line, 1000, wide), 400);
  EXPECT_NEAR(read_variance_dn2(line, 4000 - mean, {-1e6, 4000}), 400 * (0.5 - 0.5 / pi), 0.1);
}

// A variance that rounding makes up for leaves none before it: the clipped value is then one code.
TEST(ReadVariance, IsFiniteWhereNoiseIsBelowRounding) {
  std::mt19937 random(20261125);
  std::uniform_real_distribution<double> exponent(-9, 0), place(-3, 3);
  for (int draw = 0; draw < 2000; ++draw) {
    NoiseLine line;
    line.gain_dn_per_e.value = std::pow(10, exponent(random));
    line.offset_dn2.value = std::pow(10, exponent(random));
    const double std_dn = std::sqrt(line.offset_dn2.value), low = draw % 2 == 0 ? 0 : -std_dn;
    const double mean = draw % 3 == 0 ? low : low + std_dn * place(random);
    const double variance = read_variance_dn2(line, mean, {low, 1000});
    ASSERT_TRUE(variance >= 0 && variance <= 2 * (line.offset_dn2.value + line.gain_dn_per_e.value + 1.0 / 12))
        << variance << " of gain " << line.gain_dn_per_e.value << ", offset " << line.offset_dn2.value << ", mean "
        << mean;
  }
}

TEST(ReadVariance, HoldsTheContrast) {
  NoiseLine line;
  line.gain_dn_per_e.value = 0.5;
  line.offset_dn2.value = 4;
  line.contrast_squared = 1e-4;
  EXPECT_DOUBLE_EQ(read_variance_dn2(line, 1000, wide), 500 + 4 + 100);
}

TEST(ReadVariance, FollowsSimulatedPixelsClippedAtBlack) {
  std::mt19937 engine(8);
  std::normal_distribution<double> read(0, 2.2);
  NoiseLine line;
  line.gain_dn_per_e.value = 1.6;
  line.offset_dn2.value = 1.6 * 1.6 * 2.2 * 2.2 + 1.0 / 12;
  constexpr int n = 400'000;
  for (const double mean_e : {0.2, 1.0, 3.0, 10.0}) {
    std::poisson_distribution<int> photons(mean_e);
    double sum = 0, square = 0;
    for (int i = 0; i < n; ++i) {
      const double code = std::max(0.0, std::round(1.6 * (photons(engine) + read(engine))));
      sum += code;
      square += code * code;
    }
    const double mean = sum / n, variance = square / n - mean * mean;
    // Five standard errors of a variance, twice that of a normal law's, and 3 %: skewness is taken to first order.
    EXPECT_NEAR(read_variance_dn2(line, mean, {0, 4095}), variance, (10 * std::sqrt(2.0 / n) + 0.03) * variance)
        << mean_e;
  }
}

TEST(ChiSquare, HasThePublishedQuantiles) {
  // Abramowitz & Stegun, table 26.8
  EXPECT_NEAR(chi_square_quantile(1, 0.95), 3.84146, 1e-5);
  EXPECT_NEAR(chi_square_quantile(2, 0.5), 1.38629, 1e-5);
  EXPECT_NEAR(chi_square_quantile(8, 0.9), 13.3616, 1e-4);
  EXPECT_NEAR(chi_square_quantile(30, 0.99), 50.8922, 1e-4);
  EXPECT_EQ(chi_square_probability(5, 0), 0);
  EXPECT_EQ(chi_square_probability(5, -1), 0);
  EXPECT_NEAR(chi_square_probability(24, 1000), 1, 1e-12);
}

TEST(ChiSquare, MeanBelowALimitIsThatOfDraws) {
  std::mt19937 engine(2);
  std::chi_squared_distribution<double> chi(24);
  const double limit = chi_square_quantile(24, 0.8);
  double sum = 0, n = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = chi(engine);
    sum += x < limit ? x / 24 : 0;
    n += x < limit ? 1 : 0;
  }
  EXPECT_NEAR(chi_square_mean_below(24, limit), sum / n, 5 * std::sqrt(2.0 / 24 / n));
  EXPECT_NEAR(chi_square_mean_below(24, 1000), 1, 1e-12);
}

// With a single level of light the points give one sum, and the prior separates it.
TEST(FitNoiseLineWithPrior, IsThePriorWhereThereAreNoPoints) {
  const NoisePrior prior{.gain_dn_per_e = 0.5, .offset_dn2 = 4, .gain_log_std = 0.4, .offset_log_std = 1};
  const NoiseLine line = fit_noise_line({}, 0, prior);
  EXPECT_NEAR(line.gain_dn_per_e.value, 0.5, 1e-9);
  EXPECT_NEAR(line.offset_dn2.value, 4, 1e-9);
  EXPECT_NEAR(line.gain_dn_per_e.standard_error, 0.4 * 0.5, 1e-9);
  EXPECT_NEAR(line.offset_dn2.standard_error, 4, 1e-9);
}

TEST(FitNoiseLineWithPrior, KeepsWhatThePointsStateAndTheRestOfThePrior) {
  const NoisePrior prior{.gain_dn_per_e = 0.5, .offset_dn2 = 4, .gain_log_std = 0.4, .offset_log_std = 1};
  std::vector<NoisePoint> points(20, {0, 9, 4000, wide});  // in the dark: the offset is 9
  const NoiseLine dark = fit_noise_line(points, 0, prior);
  EXPECT_NEAR(dark.offset_dn2.value, 9, 0.05);
  EXPECT_NEAR(dark.gain_dn_per_e.value, 0.5, 1e-6);
  points.clear();
  for (int i = 0; i < 40; ++i) points.push_back({20.0 * i, 0.8 * 20 * i + 9, 4000, wide});
  const NoiseLine all = fit_noise_line(points, 0, prior);
  EXPECT_NEAR(all.gain_dn_per_e.value, 0.8, 5 * all.gain_dn_per_e.standard_error);
  EXPECT_NEAR(all.offset_dn2.value, 9, 5 * all.offset_dn2.standard_error);
  EXPECT_LT(all.gain_dn_per_e.standard_error, 0.02 * 0.8);
}

}  // namespace
}  // namespace lowlux::calib
