#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/capture/synthetic/burst_scene.h"

namespace lowlux::capture {
namespace {

using test::burst_of;

constexpr int width = 200, height = 150;

// A point of frame 0 lies in a box that is `margin` larger on every side.
bool within(const ImageBox& box, ImagePoint p, double margin_px) {
  return p.x_px > box.left_px - margin_px && p.x_px < box.right_px + margin_px && p.y_px > box.top_px - margin_px &&
         p.y_px < box.bottom_px + margin_px;
}

BurstOptions walkers(int movers) {
  BurstOptions burst;
  burst.reduction = 2;
  burst.movers = movers, burst.mover_size_px = 25, burst.mover_speed_px = 6.5;
  burst.shake_px = 15, burst.roll_deg = 1.5;
  return burst;
}

// On a flat scene an object is all that differs: what the truth states as touched is touched, and nothing else.
TEST(BurstObjects, CoverThePixelsThatTheTruthStatesAndNoOthers) {
  InlineExecutor executor;
  const BurstSource with = burst_of(*flat_scene(test::setup_of(2 * width, 2 * height, 1)), walkers(3));
  const BurstSource without = burst_of(*flat_scene(test::setup_of(2 * width, 2 * height, 1)), walkers(0));
  for (const std::uint32_t i : {0U, 1U, 5U, 9U}) {
    const Plane<float> a = with.mosaic_e(i, executor), b = without.mosaic_e(i, executor);
    const BurstTruth truth = with.truth(i);
    ASSERT_EQ(truth.movers.size(), 3U);
    const RigidMotion back = inverse(truth.camera_motion);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const ImagePoint p = back.at({static_cast<double>(x), static_cast<double>(y)});
        const bool touched =
            std::ranges::any_of(truth.movers, [&](const ImageBox& box) { return within(box, p, 0.5); });
        const bool inside =
            std::ranges::any_of(truth.movers, [&](const ImageBox& box) { return within(box, p, -0.5); });
        const double change = std::fabs(a.at(x, y) / b.at(x, y) - 1);
        ASSERT_TRUE(touched || change == 0) << i << ' ' << x << ' ' << y;
        ASSERT_TRUE(!inside || change > 0.4) << "at least one EV darker or brighter";
      }
    }
  }
}

// A test of merging asks this: which pixels of frame 0 show something else in any frame?
TEST(BurstObjects, AMaskOfAllFramesFollowsFromTheTruth) {
  InlineExecutor executor;
  constexpr std::uint32_t frames = 6;
  const BurstSource source = burst_of(*flat_scene(test::setup_of(2 * width, 2 * height, 1)), walkers(2));
  const auto masked = [&](ImagePoint p, double margin_px) {
    for (std::uint32_t i = 0; i < frames; ++i) {
      for (const ImageBox& box : source.truth(i).movers) {
        if (within(box, p, margin_px)) return true;
      }
    }
    return false;
  };
  const float background = test::burst_of(*flat_scene(test::setup_of(2 * width, 2 * height, 1)), walkers(0))
                               .signal_e(0, executor)
                               .plane[1]
                               .at(50, 50);
  int free = 0;
  for (std::uint32_t i = 0; i < frames; ++i) {
    const CameraRgb frame = source.signal_e(i, executor);
    const RigidMotion motion = source.truth(i).motion;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const ImagePoint p{static_cast<double>(x), static_cast<double>(y)}, moved = motion.at(p);
        const int column = static_cast<int>(std::lround(moved.x_px)), row = static_cast<int>(std::lround(moved.y_px));
        // Pixels of frame 0 are exact; the pixel nearest to a moved one reaches up to 0.71 px farther.
        if (masked(p, i == 0 ? 0.5 : 0.5 + 0.71)) continue;
        if (column < 0 || column >= width || row < 0 || row >= height) continue;
        EXPECT_NEAR(frame.plane[1].at(column, row), background, 1e-5 * background) << i << ' ' << x << ' ' << y;
        ++free;
      }
    }
  }
  EXPECT_GT(free, width * height);
}

TEST(BurstObjects, ShowAnotherPartOfTheSceneAsSharpAsItIs) {
  InlineExecutor executor;
  const auto texture = [](int u, int v) { return 0.3 + 0.2 * std::sin(0.7 * u) * std::cos(0.4 * v); };
  BurstOptions burst = walkers(1);
  burst.shake_px = burst.roll_deg = 0;
  burst.mover_size_px = 41;
  const SyntheticOptions options;
  const BurstSource source = burst_of(test::grey_scene(2 * width, 2 * height, texture), burst, options);
  const Mover mover = movers_of(burst, source.size(), options.seed).front();
  burst.movers = 0;
  const BurstSource empty = burst_of(test::grey_scene(2 * width, 2 * height, texture), burst, options);
  burst.drift_x_px = mover.start.x_px - mover.texture.x_px, burst.drift_y_px = mover.start.y_px - mover.texture.y_px;
  // Drifted by once the difference, the scene has the part at the object's place in frame 0.
  const BurstSource drifted = burst_of(test::grey_scene(2 * width, 2 * height, texture), burst, options);
  const CameraRgb found = source.signal_e(0, executor), expected = drifted.signal_e(1, executor);
  const ImageBox box = mover.box(0);
  for (int y = static_cast<int>(box.top_px) + 2; y < box.bottom_px - 1; ++y) {
    for (int x = static_cast<int>(box.left_px) + 2; x < box.right_px - 1; ++x) {
      const double of_part = mover.gain * expected.plane[1].at(x, y);
      ASSERT_NEAR(found.plane[1].at(x, y), of_part, 2e-5 * of_part) << "floats";
    }
  }
}

TEST(BurstObjects, LaterObjectsAreInFront) {
  InlineExecutor executor;
  BurstOptions burst;
  burst.reduction = 2;
  burst.movers = 40, burst.mover_size_px = 50;
  const auto scene = [] { return *flat_scene(test::setup_of(2 * width, 2 * height, 1)); };
  const SyntheticOptions options;
  const BurstSource source = burst_of(scene(), burst, options);
  const std::vector<Mover> movers = movers_of(burst, source.size(), options.seed);
  const CameraRgb found = source.signal_e(2, executor);
  burst.movers = 0;
  const double background = burst_of(scene(), burst).signal_e(0, executor).plane[1].at(9, 9);
  int overlaps = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const ImagePoint p{static_cast<double>(x), static_cast<double>(y)};
      const auto touching = [&](const Mover& m) { return within(m.box(2), p, 0.5); };
      overlaps += std::count_if(movers.begin(), movers.end(), touching) > 1;
      const auto front = std::find_if(movers.rbegin(), movers.rend(), touching);
      if (front == movers.rend() || !within(front->box(2), p, -0.5)) continue;
      ASSERT_NEAR(found.plane[1].at(x, y), front->gain * background, 1e-5 * front->gain * background);
    }
  }
  EXPECT_GT(overlaps, 100);
}

// The picture is a ramp down the sky, and another down the ground.
TEST(BurstObjects, TheForegroundStaysWhereTheSkyDrifts) {
  InlineExecutor executor;
  constexpr int horizon = 100;
  const auto level = [](int u, int v) { return 0.2 + 1e-3 * v + (v >= 2 * horizon ? 0.4 : 0) + 0 * u; };
  BurstOptions burst;
  burst.reduction = 2, burst.horizon_px = horizon, burst.drift_y_px = 7;
  const BurstSource source = burst_of(test::grey_scene(2 * width, 2 * height, level), burst);
  const CameraRgb first = source.signal_e(0, executor), later = source.signal_e(3, executor);
  EXPECT_EQ(source.truth(3).camera_motion.y_px, 0);
  EXPECT_EQ(source.truth(3).motion.y_px, 21);
  for (int y = 0; y < height; ++y) {
    const float found = later.plane[1].at(50, y);
    if (y >= horizon) {
      EXPECT_EQ(found, first.plane[1].at(50, y)) << y;
    } else if (y >= 21 + 3) {
      EXPECT_NEAR(found, first.plane[1].at(50, y - 21), 1e-5 * found) << "floats, row " << y;
    }
  }
}

TEST(BurstObjects, TheHorizonMovesWithTheCamera) {
  InlineExecutor executor;
  constexpr int horizon = 60;
  const auto level = [](int, int v) { return v >= 2 * horizon ? 0.8 : 0.1; };
  BurstOptions burst;
  burst.reduction = 2, burst.horizon_px = horizon, burst.shake_px = 10;
  const BurstSource source = burst_of(test::grey_scene(2 * width, 2 * height, level), burst);
  for (const std::uint32_t i : {0U, 1U, 2U, 3U}) {
    const CameraRgb frame = source.signal_e(i, executor);
    const double sky = frame.plane[1].at(9, 5), ground = frame.plane[1].at(9, height - 5);
    EXPECT_NEAR(ground / sky, 8, 1e-4);
    double covered = 0;  // rows of the foreground, the part of one at the horizon included
    for (int y = 0; y < height; ++y) covered += (frame.plane[1].at(9, y) - sky) / (ground - sky);
    EXPECT_NEAR(height - covered, horizon + source.truth(i).camera_motion.y_px, 1e-3) << i;
  }
}

}  // namespace
}  // namespace lowlux::capture
