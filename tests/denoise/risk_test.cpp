#include "denoise/risk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <span>
#include <vector>

#include "tests/denoise/draws.h"

namespace lowlux::denoise {
namespace {

using test::MeanOf;

constexpr double noise_e = 1.5;

/// A slow wave with an edge in it.
std::vector<double> scene(std::size_t size) {
  std::vector<double> mean_e(size);
  for (std::size_t i = 0; i < size; ++i) {
    const double wave = std::sin(2 * std::numbers::pi * static_cast<double>(i) / 40);
    mean_e[i] = (i % 64 < 23 ? 20 : 6) + 4 * wave;
  }
  return mean_e;
}

std::vector<double> variances(const std::vector<double>& mean_e) {
  std::vector<double> out(mean_e.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = mean_e[i] + noise_e * noise_e;
  return out;
}

std::vector<double> drawn(const std::vector<double>& mean_e, std::uint32_t draw) {
  std::vector<double> out(mean_e.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = test::noisy_charge_e(71, static_cast<std::uint32_t>(i), draw, mean_e[i], noise_e);
  }
  return out;
}

/// Taps 1/4, 1/2, 1/4 round the circle: K_nn = 1/2, row sums of squares 3/8.
void blur(std::span<const double> in, std::span<double> out) {
  const std::size_t n = in.size();
  for (std::size_t i = 0; i < n; ++i) out[i] = 0.25 * in[(i + n - 1) % n] + 0.5 * in[i] + 0.25 * in[(i + 1) % n];
}

/// Mean squared error of blur(y): (1/N) (|K s - s|^2 + sum of v_i |K e_i|^2).
double error_of_blur(const std::vector<double>& mean_e) {
  std::vector<double> blurred(mean_e.size());
  blur(mean_e, blurred);
  double sum = 0;
  for (std::size_t i = 0; i < mean_e.size(); ++i) {
    sum += std::pow(blurred[i] - mean_e[i], 2) + 0.375 * (mean_e[i] + noise_e * noise_e);
  }
  return sum / static_cast<double>(mean_e.size());
}

/// Hard thresholds at 3 standard deviations in an orthonormal DCT of 8 samples; the DC stays.
void threshold(std::span<const double> in, std::span<double> out, double variance) {
  static const auto basis = [] {
    std::array<std::array<double, 8>, 8> rows{};
    for (std::size_t k = 0; k < 8; ++k) {
      for (std::size_t i = 0; i < 8; ++i) {
        const double phase = std::numbers::pi * static_cast<double>((2 * i + 1) * k) / 16;
        rows[k][i] = std::cos(phase) * (k == 0 ? std::sqrt(0.125) : 0.5);
      }
    }
    return rows;
  }();
  for (std::size_t block = 0; block + 8 <= in.size(); block += 8) {
    for (std::size_t i = 0; i < 8; ++i) out[block + i] = 0;
    for (const auto& row : basis) {
      double f = 0;
      for (std::size_t i = 0; i < 8; ++i) f += row[i] * in[block + i];
      if (&row != basis.data() && std::abs(f) <= 3 * std::sqrt(variance)) continue;
      for (std::size_t i = 0; i < 8; ++i) out[block + i] += row[i] * f;
    }
  }
}

double squared_error(const std::vector<double>& found, const std::vector<double>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += std::pow(found[i] - truth[i], 2);
  return sum / static_cast<double>(truth.size());
}

TEST(Risk, OfALinearFilterIsItsClosedFormForThePictureAtHand) {
  const std::vector<double> mean_e = scene(96), v = variances(mean_e), y = drawn(mean_e, 0);
  std::vector<double> blurred(y.size());
  blur(y, blurred);
  double without_trace = squared_error(blurred, y), normal = 0, exact = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    normal += (2 * 0.5 * v[i] - v[i]) / 96;                       // 2 tr(K V) - tr V
    exact += (2 * 0.5 * (y[i] + noise_e * noise_e) - y[i]) / 96;  // by V = y + sigma^2
  }
  exact -= noise_e * noise_e;
  EXPECT_NEAR(poisson_gaussian_risk(y, noise_e, blur), without_trace + exact, 1e-10);  // rounding of 1e3 e-^2
  const Estimate found = estimated_risk(y, v, blur, {.draws = 4000});
  EXPECT_NEAR(found.value, without_trace + normal, 5 * found.standard_error);
  // Var(n^T K n) = 2 tr(K V K V) of a symmetric K; 4 / N^2 of it is the term's.
  double trace = 0;
  for (std::size_t i = 0; i < 96; ++i) trace += v[i] * (0.25 * v[i] + 0.125 * v[(i + 1) % 96]);
  const double predicted = std::sqrt(8 * trace / (96.0 * 96.0) / 4000);
  EXPECT_NEAR(found.standard_error / predicted, 1,
              5 * 0.02);  // of a variance from 4000 draws: 1 / sqrt(8000), and tails
}

TEST(Risk, OfALinearFilterIsTheTrueErrorInTheMean) {
  const std::vector<double> mean_e = scene(64), v = variances(mean_e);
  MeanOf normal, exact;
  for (std::uint32_t draw = 0; draw < 1500; ++draw) {
    const std::vector<double> y = drawn(mean_e, draw);
    normal.add(estimated_risk(y, v, blur, {.seed = draw}).value);
    exact.add(poisson_gaussian_risk(y, noise_e, blur));
  }
  const double truth = error_of_blur(mean_e);
  EXPECT_NEAR(normal.mean(), truth, 5 * normal.standard_error());
  EXPECT_NEAR(exact.mean(), truth, 5 * exact.standard_error());
  EXPECT_LT(5 * normal.standard_error(), 0.1 * truth) << "too few draws to tell";
  EXPECT_LT(5 * exact.standard_error(), 0.1 * truth) << "too few draws to tell";
}

TEST(Risk, OfHardThresholdsIsWithinTenPercentOfTheTrueError) {
  const std::vector<double> mean_e = scene(128), v = variances(mean_e);
  double v_mean = 0;
  for (const double one : v) v_mean += one / 128;
  const Filter filter = [&](std::span<const double> in, std::span<double> out) { threshold(in, out, v_mean); };
  MeanOf error, normal_difference, exact_difference, coarse;
  for (std::uint32_t draw = 0; draw < 600; ++draw) {
    const std::vector<double> y = drawn(mean_e, draw);
    std::vector<double> filtered(y.size());
    filter(y, filtered);
    const double truth = squared_error(filtered, mean_e);
    error.add(truth);
    normal_difference.add(estimated_risk(y, v, filter, {.seed = draw}).value - truth);
    coarse.add(estimated_risk(y, v, filter, {.step = 1, .seed = draw}).value - truth);
    exact_difference.add(poisson_gaussian_risk(y, noise_e, filter) - truth);
  }
  EXPECT_GT(error.mean(), 0.1 * v_mean);  // where the estimate is claimed to hold
  std::printf("  true error %.2f e-^2; estimate less truth %.2f, exact form %.2f, step of 1 %.2f\n", error.mean(),
              normal_difference.mean(), exact_difference.mean(), coarse.mean());
  EXPECT_NEAR(normal_difference.mean(), 0, 0.1 * error.mean() + 5 * normal_difference.standard_error());
  EXPECT_NEAR(exact_difference.mean(), 0, 0.1 * error.mean() + 5 * exact_difference.standard_error());
  EXPECT_GT(coarse.mean(), 0.3 * error.mean()) << "a step of 1 is known not to serve";
}

TEST(Risk, OfFiltersThatDoNothingOrEverythingIsThatOfNoiseOrSignal) {
  const std::vector<double> mean_e = scene(64), v = variances(mean_e), y = drawn(mean_e, 3);
  const Filter nothing = [](std::span<const double> in, std::span<double> out) {
    std::copy(in.begin(), in.end(), out.begin());
  };
  const Filter everything = [](std::span<const double>, std::span<double> out) {
    std::fill(out.begin(), out.end(), 0.0);
  };
  double v_mean = 0, y_mean = 0, square = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    v_mean += v[i] / 64;
    y_mean += y[i] / 64;
    square += y[i] * y[i] / 64;
  }
  const Estimate noise = estimated_risk(y, v, nothing, {.draws = 500});
  EXPECT_NEAR(noise.value, v_mean, 5 * noise.standard_error);
  EXPECT_NEAR(poisson_gaussian_risk(y, noise_e, nothing), y_mean + noise_e * noise_e, 1e-11);  // rounding
  const Estimate signal = estimated_risk(y, v, everything);
  EXPECT_NEAR(signal.value, square - v_mean, 1e-11);
  EXPECT_EQ(signal.standard_error, 0);
  EXPECT_NEAR(poisson_gaussian_risk(y, noise_e, everything), square - y_mean - noise_e * noise_e, 1e-11);
}

TEST(Risk, ScalesWithTheSquareOfTheUnit) {
  const std::vector<double> mean_e = scene(64), v = variances(mean_e), y = drawn(mean_e, 4);
  std::vector<double> scaled_y(64), scaled_v(64);
  for (std::size_t i = 0; i < 64; ++i) {
    scaled_y[i] = 16 * y[i];
    scaled_v[i] = 256 * v[i];
  }
  EXPECT_NEAR(estimated_risk(scaled_y, scaled_v, blur).value / estimated_risk(y, v, blur).value, 256, 1e-9);
}

TEST(Risk, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const std::vector<double> mean_e = scene(64), v = variances(mean_e), y = drawn(mean_e, 5);
  EXPECT_EQ(estimated_risk(y, v, blur, {.seed = 1}), estimated_risk(y, v, blur, {.seed = 1}));
  EXPECT_NE(estimated_risk(y, v, blur, {.seed = 1}).value, estimated_risk(y, v, blur, {.seed = 2}).value);
}

TEST(Risk, TakesNoNoiseNegativeAndHugeValues) {
  const std::vector<double> zero(8, 0.0), negative(8, -3.0), huge(8, 1e100);
  EXPECT_NEAR(estimated_risk(negative, zero, blur).value, 0, 1e-30);
  EXPECT_NEAR(poisson_gaussian_risk(std::vector<double>(8, 4.0), 0, blur), 0, 1e-12);  // -4 + 2 * 4 / 2
  EXPECT_TRUE(std::isfinite(poisson_gaussian_risk(negative, 2, blur)));
  EXPECT_TRUE(std::isfinite(estimated_risk(huge, zero, blur).value));
}

}  // namespace
}  // namespace lowlux::denoise
