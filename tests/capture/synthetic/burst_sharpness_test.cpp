#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/capture/synthetic/burst_scene.h"

namespace lowlux::capture::burst_sharpness_test {
namespace {

using test::burst_of;

constexpr int reduction = 2, side = 96;
constexpr double contrast = 0.8;

double sinc(double x) { return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }

// Modulation transfer of lens and pixel at f cycles per pixel of one axis, see LightGrid.
double transfer(double f) { return sinc(f) * std::pow(sinc(f / reduction), 4); }

struct Grating {
  double fx, fy;  // cycles per pixel
};

// At sample u of the scene, pixel (u - (reduction - 1) / 2) / reduction of the image.
Scene grating_scene(const Grating& g) {
  return test::grey_scene(reduction * side, reduction * side, [&](int u, int v) {
    const double x = (u - 0.5 * (reduction - 1)) / reduction, y = (v - 0.5 * (reduction - 1)) / reduction;
    return 0.5 * (1 + contrast * std::cos(2 * std::numbers::pi * (g.fx * x + g.fy * y)));
  });
}

// The modulation of a frame's green at the grating's frequency, by least squares at where its pixels are in frame 0.
double modulation(const BurstSource& source, std::uint32_t index, const Grating& g) {
  PoolExecutor executor(2);
  const CameraRgb frame = source.signal_e(index, executor);
  const RigidMotion back = inverse(source.truth(index).motion);
  double mean = 0, real = 0, imaginary = 0;
  int count = 0;
  // A disc inside of all frames; its window keeps the mean out of the sums.
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const ImagePoint p = back.at({static_cast<double>(x), static_cast<double>(y)});
      const double radius = std::hypot(p.x_px - 0.5 * (side - 1), p.y_px - 0.5 * (side - 1)) / (0.4 * side);
      if (radius >= 1) continue;
      const double window = std::pow(std::cos(0.5 * std::numbers::pi * radius), 2), v = frame.plane[1].at(x, y);
      const double phase = 2 * std::numbers::pi * (g.fx * p.x_px + g.fy * p.y_px);
      mean += window * v, real += window * v * std::cos(phase), imaginary += window * v * std::sin(phase);
      ++count;
    }
  }
  EXPECT_GT(count, 1000);
  return 2 * std::hypot(real, imaginary) / mean;
}

// What the samples of the scene repeat of the grating at 2 - f cycles per pixel falls on f again once pixels sample it:
// the largest relative deviation of the modulation.
double replica(const Grating& g) {
  double sum = 0;
  for (const double f : {g.fx, g.fy}) sum += std::fabs(transfer(reduction - f) / transfer(f));
  return sum;
}

TEST(BurstSharpness, FramesMovedByFractionsOfAPixelHaveTheModulationOfTheFirst) {
  for (const Grating& g : {Grating{0.125, 0}, {0, 0.25}, {0.3125, 0}, {0.375, 0}, {0.25, 0.25}, {0.4375, 0.125}}) {
    const double expected = contrast * transfer(g.fx) * transfer(g.fy);
    // The spectrum of the window, and floats: 6e-4 of the mean was measured.
    const double tolerance = 0.001 + expected * replica(g);
    BurstOptions burst;
    burst.reduction = reduction;
    burst.drift_x_px = 0.5, burst.drift_y_px = 0.25;
    const BurstSource source = burst_of(grating_scene(g), burst);
    const double first = modulation(source, 0, g);
    EXPECT_NEAR(first, expected, tolerance) << g.fx << ' ' << g.fy;
    for (const std::uint32_t i : {1U, 2U, 3U}) {
      EXPECT_NEAR(modulation(source, i, g), first, tolerance) << g.fx << ' ' << g.fy << " frame " << i;
    }
    RecordProperty("modulation_ratio_" + std::to_string(g.fx) + "_" + std::to_string(g.fy),
                   std::to_string(modulation(source, 1, g) / first));
  }
}

TEST(BurstSharpness, FramesThatRollHaveTheModulationOfTheFirst) {
  BurstOptions burst;
  burst.reduction = reduction;
  burst.roll_deg = 1.5, burst.shake_px = 5;
  for (const Grating& g : {Grating{0.25, 0}, {0, 0.375}}) {
    const BurstSource source = burst_of(grating_scene(g), burst);
    const double first = modulation(source, 0, g);
    for (std::uint32_t i = 1; i < 8; ++i) {
      EXPECT_NEAR(modulation(source, i, g), first, 0.001 + first * replica(g)) << i;
    }
  }
}

// Linear interpolation of frame 0 at half a pixel would lose 1 - cos(pi / 4) = 29 % of a grating of 0.25.
TEST(BurstSharpness, TheTestSeesWhatInterpolationLoses) {
  const Grating g{0.25, 0};
  BurstOptions burst;
  burst.reduction = reduction;
  burst.drift_x_px = 0.5;
  const BurstSource source = burst_of(grating_scene(g), burst);
  InlineExecutor executor;
  const CameraRgb moved = source.signal_e(1, executor), first = source.signal_e(0, executor);
  double of_moved = 0, of_interpolated = 0;
  for (int y = 30; y < 60; ++y) {
    for (int x = 30; x < 62; ++x) {
      const auto second_difference = [](double a, double b, double c) { return std::pow(a - 2 * b + c, 2); };
      const auto half = [&](int at) { return 0.5 * (first.plane[1].at(at, y) + first.plane[1].at(at + 1, y)); };
      const float* row = moved.plane[1].row(y);
      of_moved += second_difference(row[x - 1], row[x], row[x + 1]);
      of_interpolated += second_difference(half(x - 1), half(x), half(x + 1));
    }
  }
  EXPECT_NEAR(std::sqrt(of_interpolated / of_moved), std::cos(std::numbers::pi / 4), 0.01) << "the replica";
}

}  // namespace
}  // namespace lowlux::capture::burst_sharpness_test
