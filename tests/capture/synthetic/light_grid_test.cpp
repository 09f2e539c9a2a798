#include "capture/synthetic/light_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace lowlux::capture {
namespace {

double cubic_spline(double x) {
  x = std::fabs(x);
  if (x >= 2) return 0;
  return x >= 1 ? std::pow(2 - x, 3) / 6 : 2.0 / 3 - x * x + x * x * x / 2;
}

// The mean of the spline of sample 0 over samples first to first + length. Simpson's rule is exact between its knots.
double mean_of_spline(double first, double length) {
  double sum = 0;
  for (double from = first; from < first + length;) {
    const double to = std::min(std::floor(from) + 1, first + length);
    sum += (to - from) / 6 * (cubic_spline(from) + 4 * cubic_spline(0.5 * (from + to)) + cubic_spline(to));
    from = to;
  }
  return sum / length;
}

int mirrored(int k, int count) {
  while (k < 0 || k >= count) k = k < 0 ? -1 - k : 2 * count - 1 - k;
  return k;
}

// Weights of the samples in a pixel at a position, by its definition.
std::vector<double> weights_at(double x_px, int samples, int reduction) {
  std::vector<double> weights(static_cast<std::size_t>(samples), 0.0);
  const double first = reduction * x_px - 0.5;
  for (int k = static_cast<int>(std::floor(first)) - 3; k <= first + reduction + 3; ++k) {
    weights[static_cast<std::size_t>(mirrored(k, samples))] += mean_of_spline(first - k, reduction);
  }
  return weights;
}

double oracle(const Plane<float>& plane, int reduction, ImagePoint at) {
  const auto across = weights_at(at.x_px, plane.width(), reduction);
  const auto down = weights_at(at.y_px, plane.height(), reduction);
  double sum = 0;
  for (int y = 0; y < plane.height(); ++y) {
    for (int x = 0; x < plane.width(); ++x) {
      sum += down[static_cast<std::size_t>(y)] * across[static_cast<std::size_t>(x)] * plane.at(x, y);
    }
  }
  return sum;
}

CameraRgb random_samples(int width, int height, std::mt19937& random) {
  std::uniform_real_distribution<float> light(0, 100);
  CameraRgb out(width, height);
  for (Plane<float>& plane : out.plane) std::generate_n(plane.data(), plane.size(), [&] { return light(random); });
  return out;
}

LightGrid grid_of(const CameraRgb& samples, int reduction, int top_px = 0) {
  InlineExecutor executor;
  return {samples.view(), reduction, top_px, executor};
}

TEST(LightGrid, IsTheMeanOfTheSplineOverThePixelAtAnyPosition) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (const int reduction : {1, 2, 3, 4, 8}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 13}, {17, 2}, {24, 19}}) {
      const CameraRgb samples = random_samples(width, height, random);
      const LightGrid grid = grid_of(samples, reduction);
      std::uniform_real_distribution<double> anywhere(-60, 60);
      for (int i = 0; i < 40; ++i) {
        const ImagePoint at{anywhere(random), anywhere(random)};
        for (int k = 0; k < 3; ++k) {
          // 2e-6 relative to the largest sample: floats.
          ASSERT_NEAR(grid.at(k, at), oracle(samples.plane[k], reduction, at), 2e-4)
              << reduction << ' ' << width << 'x' << height << ' ' << at.x_px << ' ' << at.y_px;
        }
      }
    }
  }
}

TEST(LightGrid, KeepsConstantsAndTheRangeOfTheSamples) {
  std::mt19937 random(3);
  CameraRgb samples = random_samples(31, 22, random);
  std::fill_n(samples.plane[1].data(), samples.plane[1].size(), 7.0F);
  const auto [least, most] = std::minmax_element(samples.plane[0].data(), samples.plane[0].data() + 31 * 22);
  const LightGrid grid = grid_of(samples, 2);
  std::uniform_real_distribution<double> anywhere(-9, 25);
  for (int i = 0; i < 1000; ++i) {
    const ImagePoint at{anywhere(random), anywhere(random)};
    EXPECT_NEAR(grid.at(1, at), 7, 7e-6) << "floats";
    EXPECT_GE(grid.at(0, at), *least * (1 - 1e-6F));
    EXPECT_LE(grid.at(0, at), *most * (1 + 1e-6F));
  }
}

TEST(LightGrid, StartsAtItsRow) {
  std::mt19937 random(5);
  const CameraRgb samples = random_samples(20, 30, random);
  const LightGrid grid = grid_of(samples, 2), lower = grid_of(samples, 2, 100);
  for (const double y : {0.0, 3.25, 14.9}) EXPECT_EQ(lower.at(0, {4.5, 100 + y}), grid.at(0, {4.5, y}));
}

TEST(LightGrid, IsTheSameForEveryNumberOfThreads) {
  std::mt19937 random(6);
  const CameraRgb samples = random_samples(37, 41, random);
  const LightGrid one = grid_of(samples, 3);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const LightGrid grid(samples.view(), 3, 0, pool);
    for (int y = 0; y < 13; ++y) {
      for (int x = 0; x < 12; ++x) EXPECT_EQ(grid.at(2, {x + 0.3, y + 0.7}), one.at(2, {x + 0.3, y + 0.7}));
    }
  }
}

}  // namespace
}  // namespace lowlux::capture
