#include "isp/render/area_mean.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

SceneLinear noise_image(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.1f, 1.0f);  // half of the values are below zero
  SceneLinear out(width, height);
  for (auto& plane : out.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = normal(random);
  }
  return out;
}

SceneLinear shrunk(const SceneLinear& in, int width, int height, Executor& executor = test::one_thread) {
  SceneLinear out(width, height);
  shrink_by_area(in.view(), out.view(), executor);
  return out;
}

/// Computes the mean over a rectangle in units of pixels by splitting each pixel into n x n points.
double mean_by_points(const PlaneView<const float>& in, double x0, double x1, double y0, double y1, int n) {
  double sum = 0;
  long count = 0;
  for (int j = 0; j < in.height * n; ++j) {
    const double y = (j + 0.5) / n;
    if (y < y0 || y > y1) continue;
    for (int i = 0; i < in.width * n; ++i) {
      const double x = (i + 0.5) / n;
      if (x < x0 || x > x1) continue;
      sum += in.at(i / n, j / n);
      ++count;
    }
  }
  return sum / static_cast<double>(count);
}

TEST(ShrinkByArea, WholeFactorsGiveTheMeansOfBlocks) {
  const SceneLinear in = noise_image(24, 18, 1);
  const SceneLinear out = shrunk(in, 8, 6);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) {
        double sum = 0;
        for (int i = 0; i < 9; ++i) sum += in.plane[c].at(3 * x + i % 3, 3 * y + i / 3);
        EXPECT_NEAR(out.plane[c].at(x, y), sum / 9, 1e-6);  // float rounding
      }
    }
  }
}

TEST(ShrinkByArea, OtherFactorsWeighPixelsByTheAreaInside) {
  const SceneLinear in = noise_image(7, 5, 2);
  const SceneLinear out = shrunk(in, 4, 3);
  // 7/4 and 5/3 are multiples of 1/12 of a pixel: points at 12 per pixel lie on one side of each border.
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      const double expected =
          mean_by_points(in.view()[1], x * 7 / 4.0, (x + 1) * 7 / 4.0, y * 5 / 3.0, (y + 1) * 5 / 3.0, 12);
      EXPECT_NEAR(out.plane[1].at(x, y), expected, 1e-6);
    }
  }
}

TEST(ShrinkByArea, KeepsTheSignedMeanForAnySize) {
  std::mt19937 random(20261125);
  for (int draw = 0; draw < 40; ++draw) {
    const int width = 1 + static_cast<int>(random() % 90), height = 1 + static_cast<int>(random() % 90);
    const int to_width = 1 + static_cast<int>(random() % static_cast<unsigned>(width));
    const int to_height = 1 + static_cast<int>(random() % static_cast<unsigned>(height));
    const SceneLinear in = noise_image(width, height, 100u + static_cast<unsigned>(draw));
    const SceneLinear out = shrunk(in, to_width, to_height);
    const auto mean = [](const Plane<float>& plane) {
      double sum = 0;
      for (std::size_t i = 0; i < plane.size(); ++i) sum += plane.data()[i];
      return sum / static_cast<double>(plane.size());
    };
    for (int c = 0; c < 3; ++c) {
      // Rounding of each float, |value| below 5: far below 1e-6.
      EXPECT_NEAR(mean(out.plane[c]), mean(in.plane[c]), 1e-6) << width << "x" << height << " seed 20261125 #" << draw;
    }
  }
}

TEST(ShrinkByArea, TheSameSizeIsTheSameImageAndThreadsChangeNothing) {
  const SceneLinear in = noise_image(61, 47, 3);
  const SceneLinear same = shrunk(in, 61, 47);
  PoolExecutor three(3);
  const SceneLinear one = shrunk(in, 20, 15), several = shrunk(in, 20, 15, three);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < in.plane[c].size(); ++i) ASSERT_EQ(same.plane[c].data()[i], in.plane[c].data()[i]);
    for (std::size_t i = 0; i < one.plane[c].size(); ++i) ASSERT_EQ(one.plane[c].data()[i], several.plane[c].data()[i]);
  }
}

}  // namespace
}  // namespace lowlux::isp
