#include "capture/synthetic/burst_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/sensor_frames.h"

namespace lowlux::capture {
namespace {

constexpr ImageSize size{640, 480};
constexpr int frames = 4000;

ImagePoint centre_after(const RigidMotion& motion) {
  const ImagePoint moved = motion.at({319.5, 239.5});
  return {moved.x_px - 319.5, moved.y_px - 239.5};
}

TEST(BurstMotion, TheFirstFrameIsNeverMoved) {
  BurstOptions options;
  options.shake_px = 40, options.roll_deg = 2, options.dither_px = 3, options.drift_x_px = 5;
  options.field_rotation_deg = 1;
  for (const RigidMotion& motion : {camera_motion(options, size, 9, 0), field_motion(options, size, 0)}) {
    EXPECT_EQ(motion.at({12.5, 400}).x_px, 12.5);
    EXPECT_EQ(motion.at({12.5, 400}).y_px, 400);
  }
  EXPECT_NE(camera_motion(options, size, 9, 1).x_px, 0);
}

// Uniform in a circle of radius R: each coordinate has the variance R^2 / 4, and the kurtosis of a semicircle.
TEST(BurstMotion, ShakeIsUniformInItsCircle) {
  BurstOptions options;
  options.shake_px = 40;
  std::vector<double> x, y;
  for (std::uint32_t i = 1; i <= frames; ++i) {
    const RigidMotion motion = camera_motion(options, size, 1, i);
    EXPECT_EQ(motion.sine, 0);
    EXPECT_LE(std::hypot(motion.x_px, motion.y_px), 40 * (1 + 1e-12));
    x.push_back(motion.x_px), y.push_back(motion.y_px);
  }
  for (const auto& draws : {x, y}) {
    const test::SampleMoments m = test::moments_of(draws);
    EXPECT_NEAR(m.mean, 0, 5 * m.mean_error);
    EXPECT_NEAR(m.variance, 400, 5 * m.variance_error);
  }
}

TEST(BurstMotion, RollIsUniformAboutTheCentreOfTheImage) {
  BurstOptions options;
  options.roll_deg = 1.5;
  std::vector<double> degrees;
  for (std::uint32_t i = 1; i <= frames; ++i) {
    const RigidMotion motion = camera_motion(options, size, 1, i);
    EXPECT_NEAR(centre_after(motion).x_px, 0, 1e-9);
    EXPECT_NEAR(centre_after(motion).y_px, 0, 1e-9);
    degrees.push_back(motion.rotation_deg());
    EXPECT_LE(std::fabs(degrees.back()), 1.5 + 1e-12);
  }
  const test::SampleMoments m = test::moments_of(degrees);
  EXPECT_NEAR(m.mean, 0, 5 * m.mean_error);
  EXPECT_NEAR(m.variance, 1.5 * 1.5 / 3, 5 * m.variance_error);
}

// Of N points of the Halton sequence, each of 4 x 3 cells holds N / 12, but for a few.
TEST(BurstMotion, DitheringFillsItsSquareEvenly) {
  BurstOptions options;
  options.dither_px = 0.5;
  std::array<int, 12> count{};
  for (std::uint32_t i = 1; i <= 120; ++i) {
    const RigidMotion motion = camera_motion(options, size, i, i);
    EXPECT_LE(std::max(std::fabs(motion.x_px), std::fabs(motion.y_px)), 0.5);
    ++count[static_cast<std::size_t>(4 * (motion.x_px + 0.5)) + 4 * static_cast<std::size_t>(3 * (motion.y_px + 0.5))];
  }
  for (const int in_cell : count) EXPECT_NEAR(in_cell, 10, 3);
}

TEST(BurstMotion, TheFieldTurnsSteadilyAboutItsCentre) {
  BurstOptions options;
  options.field_rotation_deg = -0.25;
  options.drift_x_px = 0.5, options.drift_y_px = -2;
  options.field_centre = ImagePoint{-100, 900};
  for (const std::uint32_t i : {1U, 7U, 400U}) {
    const RigidMotion motion = field_motion(options, size, i);
    EXPECT_NEAR(std::remainder(motion.rotation_deg() + 0.25 * i, 360), 0, 1e-9);
    EXPECT_NEAR(motion.at({-100, 900}).x_px, -100 + 0.5 * i, 1e-9);
    EXPECT_NEAR(motion.at({-100, 900}).y_px, 900 - 2.0 * i, 1e-9);
  }
}

TEST(BurstMotion, ObjectsAreInsideTheFirstFrameAndMoveAtTheirSpeed) {
  BurstOptions options;
  options.movers = 300;
  options.mover_size_px = 31.5;
  options.mover_speed_px = 4.25;
  const std::vector<Mover> movers = movers_of(options, size, 5);
  ASSERT_EQ(movers.size(), 300U);
  for (const Mover& mover : movers) {
    const ImageBox first = mover.box(0), later = mover.box(4);
    EXPECT_GE(first.left_px, -0.5);
    EXPECT_GE(first.top_px, -0.5);
    EXPECT_LE(first.right_px, 639.5);
    EXPECT_LE(first.bottom_px, 479.5);
    EXPECT_NEAR(first.right_px - first.left_px, 31.5, 1e-9);
    EXPECT_NEAR(first.bottom_px - first.top_px, 31.5, 1e-9);
    EXPECT_NEAR(std::hypot(later.left_px - first.left_px, later.top_px - first.top_px), 17, 1e-9);
    EXPECT_TRUE((mover.gain >= 2 && mover.gain <= 4) || (mover.gain >= 0.25 && mover.gain <= 0.5)) << mover.gain;
  }
  options.movers = 2;
  const std::vector<Mover> fewer = movers_of(options, size, 5);
  EXPECT_EQ(fewer[1].start.x_px, movers[1].start.x_px) << "an object does not depend on the number of others";
  EXPECT_NE(movers_of(options, size, 6)[1].start.x_px, movers[1].start.x_px);
}

TEST(BurstMotion, ABracketRepeats) {
  BurstOptions options;
  EXPECT_EQ(exposure_factor(options, 3), 1);
  options.bracket_ev = {-4, 0, 4.5};
  for (const std::uint32_t i : {0U, 3U, 999U}) EXPECT_EQ(exposure_factor(options, i), 0x1p-4);
  EXPECT_EQ(exposure_factor(options, 4), 1);
  EXPECT_DOUBLE_EQ(exposure_factor(options, 5), 16 * std::sqrt(2.0));
}

TEST(BurstMotion, ValuesOutsideTheirRangesAreRefused) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<void (*)(BurstOptions&, double), std::string>> fields{
      {[](BurstOptions& o, double v) { o.shake_px = v; }, "hand shake"},
      {[](BurstOptions& o, double v) { o.dither_px = v; }, "dithering"},
      {[](BurstOptions& o, double v) { o.roll_deg = v; }, "roll"},
      {[](BurstOptions& o, double v) { o.field_rotation_deg = v; }, "field rotation"},
      {[](BurstOptions& o, double v) { o.drift_x_px = v; }, "drift"},
      {[](BurstOptions& o, double v) { o.drift_y_px = v; }, "drift"},
      {[](BurstOptions& o, double v) {
         o.field_centre = ImagePoint{0, v};
       },
       "centre of the field"},
      {[](BurstOptions& o, double v) { o.mover_speed_px = v; }, "speed"},
      {[](BurstOptions& o, double v) { o.movers = 1, o.mover_size_px = v; }, "size of moving objects"},
      {[](BurstOptions& o, double v) {
         o.bracket_ev = {0, v};
       },
       "exposure of a bracket"},
  };
  for (const auto& [set, clue] : fields) {
    for (const double value : {nan, inf, -inf, -1e7, 1e7}) {
      BurstOptions options;
      options.reduction = 2;
      set(options, value);
      const auto good = check_burst(options, size);
      ASSERT_FALSE(good) << clue << value;
      EXPECT_EQ(good.error().code, ErrorCode::invalid_argument);
      EXPECT_NE(good.error().message.find(clue), std::string::npos) << good.error().message;
    }
  }
}

TEST(BurstMotion, NumbersAndCombinationsThatCannotBeAreRefused) {
  const auto refused = [](const BurstOptions& options, ImageSize of = size) { return !check_burst(options, of); };
  BurstOptions good;
  good.reduction = 2;
  good.movers = 1000;
  good.horizon_px = 479;
  EXPECT_FALSE(refused(good));
  EXPECT_FALSE(refused({}));
  EXPECT_TRUE(refused({.shake_px = -1, .reduction = 2}));
  EXPECT_TRUE(refused({.movers = -1, .reduction = 2}));
  EXPECT_TRUE(refused({.movers = 1001, .reduction = 2}));
  EXPECT_TRUE(refused({.movers = 1, .mover_size_px = 481, .reduction = 2}));
  EXPECT_TRUE(refused({.reduction = 0}));
  EXPECT_TRUE(refused({.reduction = 9}));
  EXPECT_TRUE(refused({.reduction = 2}, {0, 40}));
  for (const int horizon : {-1, 0, 480}) EXPECT_TRUE(refused({.horizon_px = horizon, .reduction = 2})) << horizon;
  EXPECT_TRUE(refused({.shake_px = 1})) << "without a reduction";
  EXPECT_TRUE(refused({.horizon_px = 100})) << "without a reduction";
  EXPECT_TRUE(refused({.bracket_ev = std::vector<double>(101, 0.0)}));
}

}  // namespace
}  // namespace lowlux::capture
