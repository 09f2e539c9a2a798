#include "isp/merge/placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge::placement_test {
namespace {

/// Returns the mosaic of the smooth scene as a camera sees it that moved: what was at (x, y) is at (x + dx, y + dy).
Plane<float> moved_scene(int width, int height, BayerPhase phase, double dx, double dy, double level) {
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto colour = static_cast<int>(colour_at(phase, x, y));
      out.at(x, y) = static_cast<float>(test::smooth_scene(x - dx, y - dy, colour, level));
    }
  }
  return out;
}

Motion constant_motion(int width, int height, float dx, float dy) {
  Motion motion = no_motion(width, height);
  for (std::size_t i = 0; i < motion.dx_px.size(); ++i) {
    motion.dx_px.data()[i] = dx;
    motion.dy_px.data()[i] = dy;
  }
  return motion;
}

CameraRgb prediction_of(int width, int height, double level) {
  CameraRgb out(width, height);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.plane[c].at(x, y) = static_cast<float>(test::smooth_scene(x, y, c, level));
    }
  }
  return out;
}

/// Places a frame in whole cells.
Plane<float> placed(const FrameView& frame, double light, const Motion& motion,
                    const RgbView<const float>& prediction) {
  InlineExecutor executor;
  Plane<float> differences(frame.signal_e.width, frame.signal_e.height), out(differences.width(), differences.height());
  subtract_prediction(frame, light, motion, prediction, differences.view(), executor);
  place_nearest(std::as_const(differences).view(), frame.phase, motion, prediction, out.view(), executor);
  return out;
}

/// Returns the rms error of a placed frame, and the fraction of sites that have a value.
std::pair<double, double> error_of(const Plane<float>& placed, BayerPhase phase, double level) {
  double sum = 0, count = 0;
  for (int y = 0; y < placed.height(); ++y) {
    for (int x = 0; x < placed.width(); ++x) {
      if (std::isnan(placed.at(x, y))) continue;
      const auto colour = static_cast<int>(colour_at(phase, x, y));
      sum += std::pow(static_cast<double>(placed.at(x, y)) - test::smooth_scene(x, y, colour, level), 2);
      count += 1;
    }
  }
  return {std::sqrt(sum / count), count / static_cast<double>(placed.size())};
}

TEST(Placement, WholeCellsAreExactInEveryPhaseAndDirection) {
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    for (const auto& [dx, dy] : {std::pair{4, -2}, {-6, 8}, {0, 2}, {64, 2}}) {
      const Plane<float> frame = moved_scene(97, 63, phase, dx, dy, 2 * 50.0);
      const Motion motion = constant_motion(97, 63, static_cast<float>(dx), static_cast<float>(dy));
      const auto [error, valid] = error_of(placed({frame.view(), phase, {}}, 2, motion, {}), phase, 50);
      EXPECT_LT(error, 1e-4);
      EXPECT_DOUBLE_EQ(valid, (97.0 - std::abs(dx)) * (63.0 - std::abs(dy)) / (97 * 63));
    }
  }
}

TEST(Placement, PredictedDifferencesRemoveTheBlurOfTheRest) {
  const CameraRgb prediction = prediction_of(160, 120, 50);
  for (const auto& [dx, dy] : {std::pair{0.5F, 0.0F}, {1.0F, -1.0F}, {-2.7F, 5.3F}, {13.1F, -7.9F}}) {
    const Plane<float> frame = moved_scene(160, 120, BayerPhase::grbg, dx, dy, 50);
    const FrameView view{frame.view(), BayerPhase::grbg, {}};
    const Motion motion = constant_motion(160, 120, dx, dy);
    const double blurred = error_of(placed(view, 1, motion, {}), BayerPhase::grbg, 50).first;
    // Cubic convolution of a period of 6.3 pixels is exact to a few percent of its amplitude.
    EXPECT_LT(error_of(placed(view, 1, motion, prediction.view()), BayerPhase::grbg, 50).first, 0.12 * blurred)
        << dx << " " << dy;
    EXPECT_GT(blurred, 1.0) << dx << " " << dy;
  }
}

TEST(Placement, AConstantErrorOfThePredictionDoesNotMatter) {
  const CameraRgb exact = prediction_of(96, 96, 50);
  CameraRgb shifted(96, 96);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < exact.plane[c].size(); ++i) {
      shifted.plane[c].data()[i] = exact.plane[c].data()[i] + 1000;
    }
  }
  const Plane<float> frame = moved_scene(96, 96, BayerPhase::rggb, 0.8, 0.6, 50);
  const FrameView view{frame.view(), BayerPhase::rggb, {}};
  const Motion motion = constant_motion(96, 96, 0.8F, 0.6F);
  EXPECT_NEAR(error_of(placed(view, 1, motion, exact.view()), BayerPhase::rggb, 50).first,
              error_of(placed(view, 1, motion, std::as_const(shifted).view()), BayerPhase::rggb, 50).first, 1e-3);
}

TEST(Placement, DropsAreTheWeightedMeanOfTheirColourAsAPlainSumHasIt) {
  const int width = 41, height = 23;
  const Plane<float> scene = test::flat_mosaic(width, height, 30);
  Plane<float> frame = test::noisy_frame(scene, 0, 3, 5, 0);
  frame.at(20, 11) = std::numeric_limits<float>::quiet_NaN();
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::gbrg}) {
    for (const double of_green : {0.5, 1.0, 1.25, 1.5, 2.0}) {
      Motion motion = constant_motion(width, height, 3.3F, -1.6F);
      motion.dx_px.at(1, 0) += 0.9F;
      DropRows rows(frame.view(), phase, motion, {}, of_green);
      for (int y = 0; y < height; ++y) {
        const DropRows::Row& row = rows.row(y);
        for (int x = 0; x < width; ++x) {
          const Shift shift = motion.at(static_cast<float>(x), static_cast<float>(y));
          const double radius = colour_at(phase, x, y) == CfaColour::green ? of_green : std::max(of_green, 4.0 / 3);
          double sum = 0, weight = 0;
          for (int v = 0; v < height; ++v) {
            for (int u = 0; u < width; ++u) {
              if (colour_at(phase, u, v) != colour_at(phase, x, y) || std::isnan(frame.at(u, v))) continue;
              const double tx = 1 - std::fabs(u - x - static_cast<double>(shift.dx_px)) / radius;
              const double ty = 1 - std::fabs(v - y - static_cast<double>(shift.dy_px)) / radius;
              if (tx <= 0 || ty <= 0) continue;
              sum += tx * ty * static_cast<double>(frame.at(u, v));
              weight += tx * ty;
            }
          }
          const double mean_weight = radius * radius / (colour_at(phase, x, y) == CfaColour::green ? 2 : 4);
          ASSERT_NEAR(row.weight[x], weight / mean_weight, 1e-3);
          if (weight > 1e-3) {
            ASSERT_NEAR(row.value[x], sum / weight, 1e-2);
          }
          if (weight == 0) {
            ASSERT_TRUE(std::isnan(row.value[x]) || row.weight[x] < 1e-4);
          }
        }
      }
    }
  }
}

TEST(Placement, OutsideOfTheFrameThereIsNoValue) {
  const Plane<float> frame = test::flat_mosaic(1, 9, 5);
  const Motion motion = constant_motion(1, 9, 0, 400);
  const Plane<float> out = placed({frame.view(), BayerPhase::rggb, {}}, 1, motion, {});
  DropRows rows(frame.view(), BayerPhase::rggb, motion, {}, 1.5);
  for (int y = 0; y < 9; ++y) {
    EXPECT_TRUE(std::isnan(out.at(0, y)));
    EXPECT_TRUE(std::isnan(rows.row(y).value[0]));
  }
}

}  // namespace
}  // namespace lowlux::merge::placement_test
