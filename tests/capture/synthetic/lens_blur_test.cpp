#include "capture/synthetic/optics/lens_blur.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <vector>

// The blur of the lens against closed forms, in planes of drawn sizes.
namespace lowlux::capture {
namespace {

constexpr double float_error = 1e-6;   // relative: a few roundings of 2^-24, and what the kernel leaves out
constexpr double kernel_error = 1e-6;  // of what the kernel leaves out

/// Numbers that depend on the seed alone.
class Draws {
 public:
  explicit Draws(std::uint32_t seed) : generator_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  double log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(generator_); }

 private:
  std::mt19937 generator_;
};

/// Sizes from 1 x 1 on, many smaller than the reach of the kernel.
Plane<float> drawn_plane(Draws& draws, std::uint32_t seed) {
  Plane<float> out(seed % 3 == 0 ? 1 : draws.whole(1, 70), seed % 4 < 2 ? draws.whole(1, 70) : seed % 4 == 2 ? 1 : 3);
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = static_cast<float>(draws.log_between(1e-3, 1e4));
  return out;
}

double sum_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += plane.data()[i];
  return sum;
}

bool equal(const Plane<float>& a, const Plane<float>& b) {
  return std::equal(a.data(), a.data() + a.size(), b.data(), b.data() + b.size());
}

TEST(LensBlur, KernelIsTheDiscreteGaussian) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    Draws draws(seed);
    const double sigma = seed == 40 ? max_lens_blur_px : draws.log_between(0.02, max_lens_blur_px), t = sigma * sigma;
    const std::vector<double> kernel = LensBlur(sigma).kernel();
    double sum = kernel[0], variance = 0;
    for (std::size_t n = 0; n < kernel.size(); ++n) {
      const auto order = static_cast<double>(n);
      EXPECT_NEAR(kernel[n], std::exp(-t) * std::cyl_bessel_i(order, t), kernel_error) << seed << " " << n;
      EXPECT_GE(kernel[n], 0);
      if (n == 0) continue;
      sum += 2 * kernel[n];
      variance += 2 * order * order * kernel[n];
    }
    EXPECT_NEAR(sum, 1, 1e-12) << seed;
    const double reach = static_cast<double>(kernel.size()) + 2;
    EXPECT_NEAR(variance, t, 1e-7 * reach * reach) << seed;
    for (int i = 0; i < 8; ++i) {
      const double f = draws.between(0, 0.5), angle = 2 * std::numbers::pi * f;
      double transfer = kernel[0];
      for (std::size_t n = 1; n < kernel.size(); ++n)
        transfer += 2 * kernel[n] * std::cos(angle * static_cast<double>(n));
      EXPECT_NEAR(transfer, std::exp(t * (std::cos(angle) - 1)), kernel_error) << sigma << " " << f;
    }
  }
}

// A grating that is its own mirror image at the borders keeps its form.
TEST(LensBlur, ReducesTheModulationOfGratingsByItsTransfer) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    Draws draws(100 + seed);
    const double sigma = draws.log_between(0.1, 5), pi = std::numbers::pi;
    const int width = draws.whole(1, 60), height = draws.whole(1, 60);
    const double fx = draws.whole(0, width - 1) / (2.0 * width), fy = draws.whole(0, height - 1) / (2.0 * height);
    const auto grating = [&](int x, int y) {
      return std::cos(2 * pi * fx * (x + 0.5)) * std::cos(2 * pi * fy * (y + 0.5));
    };
    Plane<float> plane(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) plane.at(x, y) = static_cast<float>(2 + grating(x, y));
    }
    InlineExecutor one;
    LensBlur(sigma).apply(plane, one);
    const double transfer = std::exp(sigma * sigma * (std::cos(2 * pi * fx) + std::cos(2 * pi * fy) - 2));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        ASSERT_NEAR(plane.at(x, y), 2 + transfer * grating(x, y), 3 * float_error)
            << seed << ": " << width << " x " << height << ", " << sigma << " px at " << fx << ", " << fy;
      }
    }
  }
}

TEST(LensBlur, KeepsTheSumOfTheLightAndMakesNoneNegative) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Draws draws(200 + seed);
    Plane<float> plane = drawn_plane(draws, seed);
    const double before = sum_of(plane), sigma = draws.log_between(0.01, max_lens_blur_px);
    InlineExecutor one;
    LensBlur(sigma).apply(plane, one);
    const double largest = *std::max_element(plane.data(), plane.data() + plane.size());
    for (std::size_t i = 0; i < plane.size(); ++i) EXPECT_GE(plane.data()[i], -float_error * largest);
    // Each of the roundings is at most 2^-24 of 1e4, and independent of the others.
    const double roundings = std::sqrt(static_cast<double>(plane.size()) * 4 * LensBlur(sigma).kernel().size());
    EXPECT_NEAR(sum_of(plane), before, 5 * 0x1p-24 * 2e4 * roundings) << seed << " " << plane.width() << " " << sigma;
  }
}

TEST(LensBlur, OfEvenLightOrOfZeroChangesNoBit) {
  InlineExecutor one;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Draws draws(300 + seed);
    Plane<float> plane = drawn_plane(draws, seed);
    const Plane<float> before = plane.clone();
    LensBlur(0).apply(plane, one);
    EXPECT_TRUE(equal(plane, before));
    Plane<float> even(plane.width(), plane.height());
    std::fill_n(even.data(), even.size(), static_cast<float>(draws.log_between(1e-6, 1e6)));
    const float level = even.at(0, 0);
    LensBlur(draws.log_between(0.01, max_lens_blur_px)).apply(even, one);
    EXPECT_TRUE(std::all_of(even.data(), even.data() + even.size(), [&](float v) { return v == level; }));
  }
  Plane<float> single(1, 1);
  single.at(0, 0) = 3;
  LensBlur(4).apply(single, one);
  EXPECT_EQ(single.at(0, 0), 3);
}

TEST(LensBlur, OfTwoLensesIsOneOfTheRootOfTheSumOfSquares) {
  InlineExecutor one;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Draws draws(400 + seed);
    Plane<float> twice = drawn_plane(draws, seed), once = twice.clone();
    const double a = draws.log_between(0.1, 5), b = draws.log_between(0.1, 5);
    LensBlur(a).apply(twice, one);
    LensBlur(b).apply(twice, one);
    LensBlur(std::hypot(a, b)).apply(once, one);
    for (std::size_t i = 0; i < once.size(); ++i)
      ASSERT_NEAR(twice.data()[i], once.data()[i], 1e4 * float_error) << seed;
  }
}

TEST(LensBlur, HasTheSameBitsForEveryNumberOfThreads) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    Draws draws(500 + seed);
    const Plane<float> plane = drawn_plane(draws, seed);
    const LensBlur lens(draws.log_between(0.1, 8));
    InlineExecutor one;
    Plane<float> expected = plane.clone();
    lens.apply(expected, one);
    for (const int threads : {2, 3, 7}) {
      PoolExecutor pool(threads);
      Plane<float> found = plane.clone();
      lens.apply(found, pool);
      EXPECT_TRUE(equal(found, expected)) << seed << " " << threads;
    }
  }
}

}  // namespace
}  // namespace lowlux::capture
