#include "isp/metrics/picture_marks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

template <class Value>
Plane<float> plane_of(int width, int height, const Value& value) {
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.at(x, y) = static_cast<float>(value(x, y));
  }
  return out;
}

Plane<float> white_noise(int width, int height, std::uint64_t seed) {
  Plane<float> out(width, height);
  const DrawStream stream{.seed = seed, .frame = 0, .purpose = draw_purpose::electrons};
  for (int y = 0; y < height; ++y) {
    normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, {out.row(y), static_cast<std::size_t>(width)});
  }
  return out;
}

TEST(PictureMarks, LinesOfWhiteNoiseHaveAnAmplitudeOf1) {
  constexpr int seeds = 40;
  for (const int period : {2, 8, 16}) {
    double square = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      square +=
          std::pow(periodic_lines(white_noise(128, 96, static_cast<std::uint64_t>(seed)).view(), period).amplitude, 2);
    }
    EXPECT_NEAR(square / seeds, 1, 5 * std::sqrt(2.0 / (period * period - 1) / seeds)) << period;
  }
}

// A pattern of the period alone: the means of the classes are its values, and s^2 is its mean square N / (N - 1).
TEST(PictureMarks, APatternOfThePeriodHasTheSquareRootOfThePixelsOfItsClasses) {
  constexpr int width = 128, height = 96;
  for (const int period : {2, 8, 16}) {
    const auto pattern = plane_of(width, height, [&](int x, int y) { return x % period == 0 || y % period == 0; });
    const double pixels = width * height;
    EXPECT_NEAR(periodic_lines(pattern.view(), period).amplitude, std::sqrt((pixels - 1) / (period * period - 1.0)),
                1e-6 * std::sqrt(pixels));  // relative: float values, double sums
  }
  const auto fast = plane_of(width, height, [](int x, int) { return x % 2; });
  EXPECT_GT(periodic_lines(fast.view(), 8).amplitude, 5) << "multiples of the frequency count";
  const auto slow = plane_of(width, height, [](int x, int) { return x / 8 % 2; });
  EXPECT_NEAR(periodic_lines(slow.view(), 8).amplitude, 0, 1e-6) << "parts of it do not";
  EXPECT_EQ(periodic_lines(plane_of(32, 32, [](int, int) { return 0.25; }).view(), 8).amplitude, 0);
}

TEST(PictureMarks, TheRingIsBetweenItsRadii) {
  constexpr int side = 101, middle = 50;
  const auto r = [](int x, int y) { return std::hypot(x - middle, y - middle); };
  const auto mask = plane_of(side, side, [](int x, int y) { return x == middle && y == middle; });
  const auto error = plane_of(side, side, [&](int x, int y) {
    if (r(x, y) < ring_inner_px) return 1000.0;
    if (r(x, y) <= ring_outer_px) return -3.0;
    return r(x, y) <= ring_far_px ? 1000.0 : 0.5;
  });
  const RingError found = ring_error(error.view(), mask.view());
  EXPECT_NEAR(found.ring, 3, 1e-9);
  EXPECT_NEAR(found.far, 0.5, 1e-9);
  EXPECT_NEAR(found.mean, -3, 1e-9);
  int pixels = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) pixels += r(x, y) >= ring_inner_px && r(x, y) <= ring_outer_px;
  }
  EXPECT_EQ(found.pixels, pixels);
  const auto none = plane_of(side, side, [](int, int) { return 0; });
  EXPECT_TRUE(std::isnan(ring_error(error.view(), none.view()).ring));
}

// Around a filled square the distance is that of its border, which is all that is searched from.
TEST(PictureMarks, TheInsideOfALampIsNotInItsRing) {
  const auto mask = plane_of(120, 120, [](int x, int y) { return x >= 40 && x < 80 && y >= 40 && y < 80; });
  const auto error = plane_of(120, 120, [](int x, int y) { return x >= 38 && x < 82 && y >= 38 && y < 82 ? 9 : 1; });
  // Distances of two pixels, in the 39th and 82nd column and row, hold 9: 4 x 40 pixels of the ring.
  const RingError found = ring_error(error.view(), mask.view());
  EXPECT_NEAR(found.mean, 1 + 8 * (4 * 40) / found.pixels, 8 * 12 / found.pixels);  // at most 12 more at the corners
  EXPECT_NEAR(found.far, 1, 1e-9);
}

TEST(PictureMarks, BeadsAreTheAmplitudeOfAlternation) {
  const auto beads = plane_of(5, 64, [](int, int y) { return 0.5 + 0.01 * y + (y % 2 == 0 ? 0.2 : -0.2); });
  EXPECT_NEAR(bead_amplitude(beads.view()), 0.2, 1e-6);  // float
  const auto line = plane_of(5, 64, [](int x, int y) { return x + 0.01 * y; });
  EXPECT_NEAR(bead_amplitude(line.view()), 0, 1e-6);
  const auto noise = white_noise(200, 200, 3);
  // Mean squares of 40,000 correlated values: each has 2 independent neighbours in effect.
  EXPECT_NEAR(bead_amplitude(noise.view()), std::sqrt(6.0) / 4, 5 * std::sqrt(6.0) / 4 * std::sqrt(0.5 * 3 / 39600));
  EXPECT_TRUE(std::isnan(bead_amplitude(noise.view().crop(0, 0, 5, 2))));
}

}  // namespace
}  // namespace lowlux::isp
