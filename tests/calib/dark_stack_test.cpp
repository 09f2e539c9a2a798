#include "calib/dark/dark_stack.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/frames.h"

namespace lowlux::calib {
namespace {

RawDn even_frame(int dn) {
  RawDn raw = test::bayer_frame(34, 20, BayerPhase::rggb, [&](int x, int y) { return x == 3 && y == 5 ? 0 : dn + x; });
  raw.info.exposure_s = 2;
  return raw;
}

TEST(DarkStack, MeanAndVarianceAreThoseOfEachPixel) {
  DarkStack stack;
  for (const int dn : {100, 103, 109}) ASSERT_TRUE(stack.add(even_frame(dn)));
  const auto group = stack.group();
  ASSERT_TRUE(group);
  EXPECT_EQ(group->frames, 3);
  EXPECT_FLOAT_EQ(group->mean_dn.at(7, 4), 111);
  EXPECT_FLOAT_EQ(group->variance_dn2.at(7, 4), 0);  // whole frames move
  EXPECT_EQ(group->mean_dn.at(3, 5), 0);
  EXPECT_DOUBLE_EQ(group->fraction_at_zero[3], 1.0 / (17 * 10));
  EXPECT_EQ(group->fraction_at_zero[0], 0);
  EXPECT_NEAR(group->row_variance_dn2[0], 0, 1e-9);
  EXPECT_NEAR(group->frame_variance_dn2[0], (16 + 1 + 25) / 2.0, 1e-9);
}

TEST(DarkStack, VarianceOfAPixelIsAboutTheMeanOfItsSiteInEachFrame) {
  constexpr int width = 19, height = 17, frames = 4;
  std::mt19937 engine(7);
  std::normal_distribution<double> normal(600, 25);
  std::vector<RawDn> raws;
  DarkStack stack;
  for (int f = 0; f < frames; ++f) {
    raws.push_back(test::bayer_frame(width, height, BayerPhase::rggb, [&](int x, int y) {
      return static_cast<int>(std::lround(normal(engine))) + 50 * (f % 2) + 7 * (x % 5) + y;
    }));
    raws.back().info.exposure_s = 1;
    ASSERT_TRUE(stack.add(raws.back()));
  }
  const auto group = stack.group();
  ASSERT_TRUE(group);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::vector<double> off(frames);
      double mean = 0, squares = 0, pixels = 0;
      for (int f = 0; f < frames; ++f) {
        double of_site = 0;
        pixels = 0;
        for (int v = y % 2; v < height; v += 2) {
          for (int u = x % 2; u < width; u += 2) of_site += raws[f].dn.at(u, v), ++pixels;
        }
        off[f] = raws[f].dn.at(x, y) - of_site / pixels;
        mean += off[f] / frames;
      }
      for (const double value : off) squares += (value - mean) * (value - mean);
      const double variance = squares / (frames - 1) * pixels / (pixels - 1);
      EXPECT_NEAR(group->variance_dn2.at(x, y), variance, 1e-5 * variance) << x << ", " << y;  // squares are floats
    }
  }
}

/// Estimates of one temporal variance from many groups.
struct Estimates {
  double n = 0, sum = 0, squares = 0;

  void add(double value) { ++n, sum += value, squares += value * value; }
  void expect_mean(double truth, const char* what) const {
    const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / (n - 1));
    EXPECT_NEAR(mean, truth, 5 * error) << what;
  }
};

TEST(DarkStack, FramesRowsAndPixelsAreSeparatedWithoutBias) {
  constexpr int groups = 400, width = 21, height = 17, frames = 3;
  std::mt19937 engine(11);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 4; ++round) {
    const double frame = 30.0 * (round % 2), row = round < 2 ? 0 : 9, pixel = 12;
    SCOPED_TRACE(testing::Message() << "frame " << frame << ", row " << row << ", pixel " << pixel);
    Estimates of_frames, of_rows, of_pixels;
    for (int g = 0; g < groups; ++g) {
      DarkStack stack;
      for (int f = 0; f < frames; ++f) {
        std::vector<double> level(height);
        const double offset = 800 + frame * normal(engine);
        for (double& v : level) v = offset + row * normal(engine);
        RawDn raw = test::bayer_frame(width, height, BayerPhase::rggb, [&](int, int y) {
          return static_cast<int>(std::lround(level[y] + pixel * normal(engine)));
        });
        raw.info.exposure_s = 1;
        ASSERT_TRUE(stack.add(raw));
      }
      const DarkGroup group = stack.average();
      double variance = 0, n = 0;
      for (int y = 1; y < height; y += 2) {
        for (int x = 0; x < width; x += 2) variance += group.variance_dn2.at(x, y), ++n;
      }
      of_frames.add(group.frame_variance_dn2[2]);
      of_rows.add(group.row_variance_dn2[2]);
      of_pixels.add(variance / n - group.row_variance_dn2[2]);
    }
    of_frames.expect_mean(frame * frame, "frames");
    of_rows.expect_mean(row * row, "rows");
    of_pixels.expect_mean(pixel * pixel + 1 / 12.0 - row * row / (8 * 11.0 - 1) * 10, "pixels");
  }
}

TEST(DarkStack, SeparatesRowsFromPixels) {
  std::mt19937 engine(4);
  std::normal_distribution<double> normal;
  DarkStack stack;
  constexpr int side = 256, frames = 8;
  for (int f = 0; f < frames; ++f) {
    std::vector<double> row(side);
    for (double& r : row) r = 5 * normal(engine);
    RawDn raw = test::bayer_frame(side, side, BayerPhase::rggb, [&](int, int y) {
      return static_cast<int>(std::lround(500 + row[y] + 12 * normal(engine)));
    });
    raw.info.exposure_s = 1;
    ASSERT_TRUE(stack.add(raw));
  }
  const auto group = stack.group();
  ASSERT_TRUE(group);
  for (const double variance : group->row_variance_dn2) {
    EXPECT_NEAR(variance, 25, 5 * std::sqrt(2.0 / (128 * (frames - 1))) * (25 + 144.0 / 128));
  }
}

TEST(DarkStack, RefusesFramesThatDoNotBelongTogether) {
  const auto refused = [](auto change) {
    DarkStack stack;
    RawDn raw = even_frame(100);
    raw.info.temperature_c = 20;
    EXPECT_TRUE(stack.add(raw));
    change(raw);
    return !stack.add(raw);
  };
  EXPECT_FALSE(refused([](RawDn&) {}));
  EXPECT_FALSE(refused([](RawDn& r) { r.info.temperature_c = 20.9; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.temperature_c = 21.1; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.temperature_c.reset(); }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.exposure_s = 3; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.info.model = "other"; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.active.width = 32; }));
  EXPECT_TRUE(refused([](RawDn& r) { r.layout = SensorLayout::linear_rgb; }));
}

TEST(DarkStack, FlatsMayWarmUp) {
  DarkStack stack(StackedFrames::flats);
  for (const double temperature_c : {20.0, 24.0, 29.0}) {
    RawDn raw = even_frame(100);
    raw.info.temperature_c = temperature_c;
    EXPECT_TRUE(stack.add(raw));
  }
  RawDn other = even_frame(100);
  other.info.exposure_s = 3;
  EXPECT_FALSE(stack.add(other));
}

TEST(DarkStack, NeedsTwoFrames) {
  DarkStack stack;
  EXPECT_EQ(stack.group().error().code, ErrorCode::insufficient);
  ASSERT_TRUE(stack.add(even_frame(100)));
  EXPECT_EQ(stack.group().error().code, ErrorCode::insufficient);
  ASSERT_TRUE(stack.add(even_frame(100)));
  EXPECT_TRUE(stack.group());
}

}  // namespace
}  // namespace lowlux::calib
