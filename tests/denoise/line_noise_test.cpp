#include "denoise/lines/line_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include "isp/base/random/random.h"
#include "tests/denoise/draws.h"

namespace lowlux::denoise::line_noise_test {
namespace {

constexpr double read_noise_e = 4;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// Row offsets of a standard deviation, and the same in every picture of a height.
std::vector<double> row_offsets(int height, double std_e) {
  std::vector<double> out(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    out[static_cast<std::size_t>(y)] =
        std_e * normal_of_word(words_at({.seed = 8}, 0, static_cast<std::uint32_t>(y))[0]);
  }
  return out;
}

using Scene = std::function<double(int x, int y)>;  // mean charge [e-]

Plane<float> frame_of(int width, int height, const Scene& scene, const std::vector<double>& offsets) {
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double y_e = test::noisy_charge_e(9, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                              scene(x, y), read_noise_e);
      out.at(x, y) = static_cast<float>(y_e + offsets[static_cast<std::size_t>(y)]);
    }
  }
  return out;
}

/// Rms over lines from..to of what the subtraction leaves of the offsets.
double left_over(const std::vector<double>& truth, const LineOffsets& found, std::size_t from, std::size_t to) {
  double mean = 0, squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    mean += (truth[i] - found.offset_e[i]) / static_cast<double>(truth.size());
  for (std::size_t i = from; i < to; ++i) squares += std::pow(truth[i] - found.offset_e[i] - mean, 2);
  return std::sqrt(squares / static_cast<double>(to - from));
}

double left_over(const std::vector<double>& truth, const LineOffsets& found) {
  return left_over(truth, found, 0, truth.size());
}

double no_light(int, int) { return 0.1; }

/// Four colours, brighter in two of them.
double even_scene(int x, int y) { return 20.0 * (1 + 0.5 * ((x + y) % 2)); }

/// Five standard errors of an rms of n normal values, relative.
double five_errors(double n) { return 5 / std::sqrt(2 * n); }

TEST(LineNoise, OfMaskedPixelsIsRemovedToThePredictedResidual) {
  for (const int width : {16, 64, 250}) {
    const std::vector<double> truth = row_offsets(1024, 1);
    const auto found = line_offsets_of_masked(frame_of(width, 1024, no_light, truth).view(), Lines::rows);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NEAR(found->line_std_e, 1, 0.15) << width;  // 5 / sqrt(2048), times V + e^2 over V
    // V e^2 / (V + e^2) with e^2 of a mean of all pixels; 5 % for Hodges-Lehmann in place of it.
    const double error_e2 = (read_noise_e * read_noise_e + 0.1) / width;
    const double ideal = std::sqrt(error_e2 / (1 + error_e2));
    EXPECT_NEAR(found->residual_std_e / ideal, 1.015, five_errors(1024)) << width;
    EXPECT_NEAR(left_over(truth, *found) / found->residual_std_e, 1, five_errors(1024)) << width;
  }
}

TEST(LineNoise, OfMaskedPixelsBearsHotOnes) {
  const std::vector<double> truth = row_offsets(1024, 1);
  Plane<float> frame = frame_of(64, 1024, no_light, truth);
  const auto without = line_offsets_of_masked(frame.view(), Lines::rows);
  for (std::uint32_t i = 0; i < frame.size(); ++i) {
    if (words_at({.seed = 10}, i, 0)[0] < 0x02000000) frame.data()[i] += 500;  // 1 in 128: one group in 30
  }
  const auto found = line_offsets_of_masked(frame.view(), Lines::rows);
  ASSERT_TRUE(without && found);
  // About half a group of a line is moved, and its rank by half of a place: a fifth more error is allowed.
  EXPECT_LT(left_over(truth, *found), 1.2 * left_over(truth, *without));
}

TEST(LineNoise, OfTheFrameItselfIsRemovedToThePredictedResidual) {
  for (const int width : {128, 512}) {
    const std::vector<double> truth = row_offsets(512, 1);
    const auto found = line_offsets_of_frame(frame_of(width, 512, even_scene, truth).view(), Lines::rows);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NEAR(found->line_std_e, 1, 0.35) << width;  // of 510 differences by the median: 5 * 1.17 / sqrt(512)
    // Noise of the mean of a line by medians: pi / 2 (sigma^2 + 25) / width, 16 of 16.57 of it.
    EXPECT_NEAR(found->measured_std_e / std::sqrt(1.517 * (16 + 25) / width), 1, 0.05) << width;
    EXPECT_NEAR(left_over(truth, *found) / found->residual_std_e, 1, five_errors(512) + 0.1)
        << width;  // 0.1: line_std_e
    EXPECT_LT(left_over(truth, *found), 0.55) << width;
  }
}

TEST(LineNoise, WithoutAnyIsLeftAlone) {
  const std::vector<double> none = row_offsets(512, 0);
  const auto masked = line_offsets_of_masked(frame_of(64, 512, no_light, none).view(), Lines::rows);
  const auto frame = line_offsets_of_frame(frame_of(512, 512, even_scene, none).view(), Lines::rows);
  ASSERT_TRUE(masked && frame);
  // What is invented stays below the error with which a line is measured: the gain is that of chance.
  EXPECT_LT(left_over(none, *masked), 0.4 * masked->measured_std_e);
  EXPECT_LT(left_over(none, *frame), 0.4 * frame->measured_std_e);
  const auto known =
      line_offsets_of_frame(frame_of(512, 512, even_scene, none).view(), Lines::rows, {.known_std_e = 0.0});
  ASSERT_TRUE(known);
  EXPECT_EQ(known->gain, 0);
  EXPECT_EQ(left_over(none, *known), 0);
}

/// Largest of what is left of the true offsets, or was put into the picture in their place.
double worst_line(const std::vector<double>& truth, const LineOffsets& found) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) worst = std::max(worst, std::abs(truth[i] - found.offset_e[i]));
  return worst;
}

TEST(LineNoise, BelowTheLeastThatIsAskedForIsMeasuredAndLeft) {
  const Plane<float> frame = frame_of(256, 256, no_light, row_offsets(256, 1));
  const auto all = line_offsets_of_frame(frame.view(), Lines::rows);
  const auto asked = line_offsets_of_frame(frame.view(), Lines::rows, {.min_std_e = 0.5});
  const auto not_asked = line_offsets_of_frame(frame.view(), Lines::rows, {.min_std_e = 2});
  ASSERT_TRUE(all && asked && not_asked);
  EXPECT_EQ(asked->offset_e, all->offset_e);
  EXPECT_TRUE(not_asked->offset_e.empty());
  EXPECT_EQ(not_asked->line_std_e, all->line_std_e);
  EXPECT_EQ(not_asked->gain, all->gain);
  EXPECT_EQ(not_asked->residual_std_e, all->line_std_e);
}

TEST(LineNoise, EdgesOfTheSceneDoNotBecomeLines) {
  const Scene scenes[] = {
      [](int, int y) { return y < 256 ? 60.0 : 15.0; },               // a horizon
      [](int, int y) { return y >= 200 && y < 203 ? 300.0 : 20.0; },  // a lamp's thin bar
      [](int, int y) { return y >= 200 && y < 224 ? 80.0 : 20.0; },   // a wide one
      [](int x, int y) {
        return y >= 200 && y < 230 && x < 200 ? 25.0 : 20.0;
      },                                        // a faint one across part of the width
      [](int, int y) { return 20 + 0.2 * y; },  // dusk
  };
  for (const Scene& scene : scenes) {
    const std::vector<double> truth = row_offsets(512, 1), none = row_offsets(512, 0);
    const auto found = line_offsets_of_frame(frame_of(512, 512, scene, truth).view(), Lines::rows);
    ASSERT_TRUE(found);
    EXPECT_LT(left_over(truth, *found, 180, 280), 1.3 * found->residual_std_e)
        << &scene - scenes;                                        // 100 lines: 5 errors are 0.35
    EXPECT_LT(worst_line(truth, *found), 3.5) << &scene - scenes;  // no more than there was: the largest of 512
    std::printf("  %.2f e- left of 1, predicted %.2f\n", left_over(truth, *found), found->residual_std_e);
    // Without line noise, and yet with the gain for it, no more than errors of measurement may be found.
    const auto quiet = line_offsets_of_frame(frame_of(512, 512, scene, none).view(), Lines::rows, {.known_std_e = 1.0});
    ASSERT_TRUE(quiet);
    EXPECT_LT(worst_line(none, *quiet), 5 * quiet->measured_std_e) << &scene - scenes;  // of edges of 5 to 280 e-
  }
}

// A sky that becomes brighter towards the horizon has slopes of 4 to 240 e- per row, which are no offsets, and what
// offsets it has are found.
TEST(LineNoise, SlopesOfABrightSceneAreNoLines) {
  const auto sky = [](int x, int y) { return 1000 * std::exp(4.0 * y / 1000) * (1 + 0.5 * ((x + y) % 2)); };
  for (const double std_e : {0.0, 30.0}) {
    const std::vector<double> truth = row_offsets(1000, std_e);
    const auto found = line_offsets_of_frame(frame_of(512, 1000, sky, truth).view(), Lines::rows);
    ASSERT_TRUE(found) << found.error().message;
    // The error of a line differs by its brightness, up to a median of sqrt(pi / 2 * 55000 * 1.25 / 512) = 14.5 e-, and
    // the variance of robust changes has a relative error of 5 * 1.17 * sqrt(3 / 1000).
    EXPECT_NEAR(std::hypot(found->line_std_e, found->measured_std_e), std::hypot(std_e, found->measured_std_e),
                0.16 * std::hypot(std_e, found->measured_std_e) + 0.01);
    if (std_e > 0) {
      EXPECT_NEAR(found->line_std_e, std_e, 0.2 * std_e);
    }
  }
}

TEST(LineNoise, KnownByCalibrationKeepsBlindsInThePicture) {
  const Scene blinds = [](int, int y) { return y / 2 % 2 == 0 ? 20.0 : 32.0; };
  const std::vector<double> truth = row_offsets(256, 1);
  const Plane<float> frame = frame_of(512, 256, blinds, truth);
  const auto found = line_offsets_of_frame(frame.view(), Lines::rows, {.known_std_e = 1.0});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->line_std_e, 1);
  EXPECT_LT(left_over(truth, *found) / found->residual_std_e, 1 + five_errors(256)) << "its own prediction";
}

TEST(LineNoise, OfColumnsIsThatOfRowsOfTheTransposedPicture) {
  const std::vector<double> truth = row_offsets(64, 1);
  const Plane<float> frame = frame_of(100, 64, even_scene, truth);
  Plane<float> turned(64, 100);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 100; ++x) turned.at(y, x) = frame.at(x, y);
  }
  const auto rows = line_offsets_of_frame(frame.view(), Lines::rows);
  const auto columns = line_offsets_of_frame(turned.view(), Lines::columns);
  ASSERT_TRUE(rows && columns);
  EXPECT_EQ(columns->lines, Lines::columns);
  EXPECT_EQ(rows->offset_e, columns->offset_e);
  Plane<float> by_rows = frame.clone();
  subtract_lines(*rows, by_rows.view());
  subtract_lines(*columns, turned.view());
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 100; ++x) ASSERT_EQ(turned.at(y, x), by_rows.at(x, y));
  }
  EXPECT_EQ(by_rows.at(7, 5), static_cast<float>(frame.at(7, 5) - rows->offset_e[5]));
}

TEST(LineNoise, IgnoresValuesThatAreNotFinite) {
  const std::vector<double> truth = row_offsets(256, 1);
  Plane<float> frame = frame_of(256, 256, even_scene, truth);
  for (int i = 0; i < 256; ++i) frame.at(i, i) = nan;
  for (int x = 0; x < 256; ++x) frame.at(x, 100) = -std::numeric_limits<float>::infinity();
  for (const auto& found :
       {line_offsets_of_frame(frame.view(), Lines::rows), line_offsets_of_masked(frame.view(), Lines::rows)}) {
    ASSERT_TRUE(found);
    for (const double offset : found->offset_e) ASSERT_TRUE(std::isfinite(offset));
    EXPECT_EQ(found->offset_e[100], 0);
    EXPECT_TRUE(std::isfinite(found->residual_std_e));
  }
}

TEST(LineNoise, CannotBeToldFromLittleOrNothing) {
  const auto refuses = [](int width, int height, float value) {
    Plane<float> frame(width, height);
    std::fill_n(frame.data(), frame.size(), value);
    const auto masked = line_offsets_of_masked(frame.view(), Lines::rows);
    const auto of_frame = line_offsets_of_frame(frame.view(), Lines::rows);
    return !masked && !of_frame && masked.error().code == ErrorCode::insufficient;
  };
  EXPECT_TRUE(refuses(0, 0, 0));
  EXPECT_TRUE(refuses(100, 15, 1));
  EXPECT_TRUE(refuses(3, 100, 1));
  EXPECT_TRUE(refuses(100, 100, nan));
  EXPECT_FALSE(refuses(4, 16, 1));
}

TEST(LineNoise, OfAPictureOfOneValueIsNone) {
  for (const float value : {0.0f, -5.0f, 3e37f}) {
    Plane<float> frame(32, 32);
    std::fill_n(frame.data(), frame.size(), value);
    for (const auto& found :
         {line_offsets_of_frame(frame.view(), Lines::rows), line_offsets_of_masked(frame.view(), Lines::columns)}) {
      ASSERT_TRUE(found);
      EXPECT_EQ(found->gain, 0);
      EXPECT_EQ(found->residual_std_e, 0);
      for (const double offset : found->offset_e) ASSERT_EQ(offset, 0);
    }
  }
}

}  // namespace
}  // namespace lowlux::denoise::line_noise_test
