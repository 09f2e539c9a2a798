#include "calib/chart/chart_patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "tests/calib/chart_frame.h"

namespace lowlux::calib {
namespace {

/// A grid of cells of 40 px from the picture's corner on, and even patches with noise.
constexpr int cell_px = 40;

ChartPicture even_picture(double mean, double deviation) {
  ChartPicture out{CameraRgb(6 * cell_px, 4 * cell_px), Plane<std::uint8_t>(6 * cell_px, 4 * cell_px)};
  std::fill_n(out.clipped.data(), out.clipped.size(), std::uint8_t{0});
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  for (Plane<float>& plane : out.rgb.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) {
      plane.data()[i] = static_cast<float>(mean + deviation * normal(engine));
    }
  }
  return out;
}

ChartGrid whole_picture() {
  constexpr double right = 6 * cell_px - 0.5, bottom = 4 * cell_px - 0.5;
  return *grid_of({{{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}}});
}

TEST(MeasurePatches, GivesMeansAndTheirStandardErrors) {
  const auto patches = measure_patches(even_picture(0.25, 0.01), whole_picture());
  for (const ChartPatch& patch : patches) {
    EXPECT_EQ(patch.pixels, 400);  // half of 40 px, squared; none of 400 normal values is 5 deviations off
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(patch.camera_rgb[c], 0.25, 5 * 0.01 / std::sqrt(400.0));
      // The standard error of a standard deviation of 400 normal values is 1 / sqrt(800) of it.
      EXPECT_NEAR(patch.standard_error[c], 0.01 / 20, 5 * 0.01 / 20 / std::sqrt(800.0));
    }
  }
}

TEST(MeasurePatches, KeepsMeansBelowBlackSigned) {
  const auto patches = measure_patches(even_picture(-0.002, 0.01), whole_picture());
  EXPECT_NEAR(patches[10].camera_rgb[0], -0.002, 5 * 0.01 / 20);
  EXPECT_EQ(relative_error(patches), HUGE_VAL);
}

TEST(MeasurePatches, LeavesClippedPixelsAndHotOnesOut) {
  ChartPicture picture = even_picture(0.25, 0.01);
  picture.rgb.plane[1].at(20, 20) = 1;  // hot, in the first patch
  for (int i = 0; i < 3; ++i) {         // 3 of 400: below the limit
    picture.clipped.at(cell_px + 15 + i, 20) = 1;
    picture.rgb.plane[0].at(cell_px + 15 + i, 20) = 1;
  }
  for (int i = 0; i < 5; ++i) picture.clipped.at(2 * cell_px + 15 + i, 20) = 1;  // 5 of 400: above it
  const auto patches = measure_patches(picture, whole_picture());
  EXPECT_EQ(patches[0].pixels, 399);
  EXPECT_NEAR(patches[0].outlying_fraction, 1 / 400.0, 1e-12);
  EXPECT_NEAR(patches[0].camera_rgb[1], 0.25, 5 * 0.01 / 20);
  EXPECT_EQ(patches[1].pixels, 397);
  EXPECT_TRUE(usable(patches[1]));
  EXPECT_NEAR(patches[1].camera_rgb[0], 0.25, 5 * 0.01 / 20);
  EXPECT_NEAR(patches[2].clipped_fraction, 5 / 400.0, 1e-12);
  EXPECT_FALSE(usable(patches[2]));
}

TEST(MeasurePatches, KeepsAllOfAPatchWithoutNoise) {
  ChartPicture picture = even_picture(0.25, 0);
  picture.rgb.plane[0].at(20, 20) = 0.3F;  // the scatter of the others is 0 and tells of no outlier
  const auto patches = measure_patches(picture, whole_picture());
  EXPECT_EQ(patches[0].pixels, 400);
  EXPECT_EQ(patches[1].standard_error[0], 0);
}

TEST(MeasurePatches, FindsNoPixelsInPatchesTooSmall) {
  const auto patches = measure_patches(even_picture(0.25, 0.01), *grid_of({{{10, 10}, {16, 10}, {16, 14}, {10, 14}}}));
  for (const ChartPatch& patch : patches) EXPECT_FALSE(usable(patch));
  EXPECT_EQ(relative_error(patches), HUGE_VAL);
}

TEST(RelativeError, IsThatOfTheWorstChannelOfTheMedianPatch) {
  std::array<ChartPatch, chart_patch_count> patches;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    patches[i] = {.camera_rgb = {1, 2, 4}, .standard_error = {0.01, 0.04, 0.01}, .pixels = 100};
    if (i < 5) patches[i].standard_error = {1, 1, 1};
  }
  EXPECT_NEAR(relative_error(patches), 0.02, 1e-12);
}

TEST(ChartPicture, AveragesTheGreensAndKnowsWhatIsClipped) {
  RawFrame frame = test::photograph_patches({.width = 8, .height = 7}, test::daylight_chart().camera_rgb);
  std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), std::uint16_t{256});
  const double range = test::photograph_white_dn - test::photograph_black_dn;
  frame.raw.dn.at(2, 0) = 356;  // R of the second cell
  frame.raw.dn.at(3, 0) = 456;  // G
  frame.raw.dn.at(2, 1) = 206;  // G, below black
  frame.raw.dn.at(3, 1) = 16383;
  const ChartPicture picture = test::half_size(frame);
  EXPECT_EQ(picture.rgb.width(), 4);
  EXPECT_EQ(picture.rgb.height(), 3);
  EXPECT_NEAR(picture.rgb.plane[0].at(1, 0), 100 / range, 1e-8);  // floats
  EXPECT_NEAR(picture.rgb.plane[1].at(1, 0), 75 / range, 1e-8);
  EXPECT_NEAR(picture.rgb.plane[2].at(1, 0), 1, 1e-6);
  EXPECT_EQ(picture.clipped.at(1, 0), 1);
  EXPECT_EQ(picture.clipped.at(0, 0), 0);
}

}  // namespace
}  // namespace lowlux::calib
