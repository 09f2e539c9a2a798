#include <gtest/gtest.h>

#include <cmath>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::one_thread;
using Mode = WhiteBalanceChoice::Mode;

/// A grey of (600, 900, 400) electrons, a patch of another colour at x 200..239, y 100..139, one that saturates and one
/// without light.
RawFrame patches() {
  return test::night_frame(
      {},
      [](int x, int y) {
        if (x >= 200 && x < 240 && y >= 100 && y < 140) return std::array{300.0, 1000.0, 800.0};
        if (x >= 20 && x < 60 && y >= 20 && y < 60) return std::array{9000.0, 9000.0, 9000.0};
        if (x >= 20 && x < 60 && y >= 100 && y < 140) return std::array{0.0, 0.0, 0.0};
        return std::array{600.0, 900.0, 400.0};
      },
      301, 203);
}

DevelopOptions picking(int x, int y, int size) {
  return {.white_balance = {.mode = Mode::picked, .picked = {x, y, size}},
          .exposure_ev = 0,
          .tone = ToneCurve::none,
          .space = OutputSpace::linear_srgb,
          .samples = SampleType::f32};
}

TEST(PickedWhite, IsTheMeanColourOfTheSquare) {
  const RawFrame frame = patches();
  const auto plan = plan_develop(frame, picking(220, 120, 30), one_thread);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->rendering.white_balance_rule, "picked");
  // 225 pixels of red at least: 0.4 % of shot noise each way, five of them.
  EXPECT_NEAR(plan->rendering.neutral[0], 0.3, 0.3 * 0.02);
  EXPECT_NEAR(plan->rendering.neutral[1], 1.0, 1e-12);
  EXPECT_NEAR(plan->rendering.neutral[2], 0.8, 0.8 * 0.02);
}

TEST(PickedWhite, MakesTheSquareNeutralInEveryOrientationAndAtHalfSize) {
  for (const bool half : {false, true}) {
    for (int o = 1; o <= 8; ++o) {
      RawFrame frame = patches();
      frame.raw.info.orientation = static_cast<Orientation>(o);
      const int cell = half ? 2 : 1, width = 301 / cell, height = 203 / cell;
      const int x = 220 / cell, y = 120 / cell;  // before orientation
      const int from_right = width - 1 - x, from_below = height - 1 - y;
      const std::pair<int, int> upright[] = {{x, y}, {from_right, y}, {from_right, from_below}, {x, from_below},
                                             {y, x}, {from_below, x}, {from_below, from_right}, {y, from_right}};
      DevelopOptions options = picking(upright[o - 1].first, upright[o - 1].second, 24 / cell);
      options.half = half;
      const auto developed = develop(frame, options, one_thread);
      ASSERT_TRUE(developed) << developed.error().message;
      const auto& image = std::get<SceneLinear>(developed->picture);
      Vector3 mean{};
      for (int c = 0; c < 3; ++c) {
        for (int j = -8; j < 8; ++j) {
          for (int i = -8; i < 8; ++i) mean[c] += image.plane[c].at(x + i / cell, y + j / cell) / 256;
        }
      }
      EXPECT_NEAR(mean[0] / mean[1], 1, 0.03) << "orientation " << o;  // shot noise of the picked pixels, times five
      EXPECT_NEAR(mean[2] / mean[1], 1, 0.03) << "orientation " << o;
    }
  }
}

TEST(PickedWhite, LeavesOutHotPixels) {
  RawFrame frame = patches();
  const double before = plan_develop(frame, picking(220, 120, 16), one_thread)->rendering.neutral[0];
  frame.raw.dn.at(220, 120) = 65535;  // a red site of RGGB
  frame.raw.dn.at(224, 117) = static_cast<std::uint16_t>(frame.raw.white_dn[1] - 1);
  const auto plan = plan_develop(frame, picking(220, 120, 16), one_thread);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_NEAR(plan->rendering.neutral[0], before, 0.02 * before);  // one of 64 red sites less, of 6 % of noise each
  EXPECT_NEAR(plan->rendering.neutral[2], 0.8, 0.8 * 0.03);
  DevelopOptions as_it_is = picking(220, 120, 16);
  as_it_is.find_defects = false;
  const auto hot = plan_develop(frame, as_it_is, one_thread);
  EXPECT_TRUE(!hot || hot->rendering.neutral[0] > 1.1 * before) << "the pixel is bright enough to be seen";
}

TEST(PickedWhite, CountsGainMaps) {
  RawFrame frame = patches();
  frame.corrections.gain_maps = {{.bottom = 203, .right = 301, .gain = {1}}};
  GainMap red = frame.corrections.gain_maps[0];
  red.row_pitch = red.column_pitch = 2;  // red sites of RGGB
  red.gain = {2};
  frame.corrections.gain_maps.push_back(red);
  const auto plan = plan_develop(frame, picking(220, 120, 30), one_thread);
  ASSERT_TRUE(plan);
  EXPECT_NEAR(plan->rendering.neutral[0], 0.6, 0.6 * 0.02);
}

TEST(PickedWhite, SaturatedDarkAndOutsideAreErrors) {
  const RawFrame frame = patches();
  const auto refused = [&](const DevelopOptions& options, const char* part) {
    const auto plan = plan_develop(frame, options, one_thread);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(plan.error().message.find(part), std::string::npos) << plan.error().message;
  };
  refused(picking(40, 40, 16), "saturated");
  refused(picking(40, 120, 16), "too dark");
  refused(picking(301, 0, 16), "outside the upright image of 301 x 203");
}

TEST(PickedWhite, TheCornerIsPickedToo) {
  for (const auto& [x, y] : {std::pair{0, 0}, std::pair{300, 202}, std::pair{300, 0}, std::pair{0, 202}}) {
    const auto plan = plan_develop(patches(), picking(x, y, 16), one_thread);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_NEAR(plan->rendering.neutral[0], 600.0 / 900, 0.05);
  }
}

TEST(GivenGains, AreTheReciprocalOfTheNeutral) {
  DevelopOptions options = picking(0, 0, 1);
  options.white_balance = {.mode = Mode::gains, .gains = {4, 2, 3}};
  const auto plan = plan_develop(patches(), options, one_thread);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->rendering.white_balance_rule, "gains");
  EXPECT_NEAR(plan->rendering.white_gain[0], 2, 1e-6);
  EXPECT_NEAR(plan->rendering.white_gain[1], 1, 1e-6);
  EXPECT_NEAR(plan->rendering.white_gain[2], 1.5, 1e-6);
}

}  // namespace
}  // namespace lowlux::isp
