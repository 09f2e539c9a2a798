// Videos of pictures against their light without noise: what moves is above each frame by itself, but for dim objects,
// and what stands still keeps its gain.
#include <gtest/gtest.h>

#include <stdexcept>
#include <utility>

#include "tests/sensor_bench/moving_video.h"

namespace lowlux {
namespace {

using test::VideoMotion;

constexpr int frames = 10;

test::VideoScene scene_of(const char* name) {
  InlineExecutor one;
  auto scene = test::video_scene(name, one);
  if (!scene) throw std::runtime_error(scene.error().message);
  return *std::move(scene);
}

class MotionCompensation : public testing::TestWithParam<const char*> {};

TEST_P(MotionCompensation, OfAMovingCameraIsAboveEachFrameByItself) {
  const test::VideoScene scene = scene_of(GetParam());
  for (const VideoMotion motion : {VideoMotion::drift, VideoMotion::pan, VideoMotion::hand_held}) {
    for (const double mean_e : {5.0, 20.0, 200.0}) {
      const auto [moving, rest] = test::take_video(scene, motion, mean_e, frames);
      EXPECT_GT(moving.compensated_db, moving.level_db) << name_of(motion) << " " << mean_e;
      EXPECT_GT(moving.compensated_db, moving.still_db + 0.1) << name_of(motion) << " " << mean_e;
    }
  }
}

// An object of 5 e- against a read noise of 2 e- is not always detected. A quarter of a decibel is less than can be
// seen.
TEST_P(MotionCompensation, OfAMovingObjectIsAboveEachFrameAndTheRestKeepsItsGain) {
  const test::VideoScene scene = scene_of(GetParam());
  for (const double mean_e : {5.0, 20.0, 200.0}) {
    const auto [object, rest] = test::take_video(scene, VideoMotion::object, mean_e, frames);
    EXPECT_GT(object.compensated_db, object.level_db - (mean_e < 10 ? 0.25 : 0)) << mean_e;
    EXPECT_GT(object.compensated_db, object.still_db - 0.05) << mean_e;
    EXPECT_GT(rest.compensated_db, rest.still_db - 0.2) << mean_e;
    EXPECT_GT(rest.compensated_db, rest.level_db + 0.4) << mean_e;
  }
}

// A still scene is not searched.
TEST_P(MotionCompensation, OfAStillSceneChangesNothing) {
  const auto [moving, rest] = test::take_video(scene_of(GetParam()), VideoMotion::still, 20, frames);
  EXPECT_EQ(rest.compensated_db, rest.still_db);
  EXPECT_GT(rest.compensated_db, rest.level_db + 0.8);
}

INSTANTIATE_TEST_SUITE_P(Pictures, MotionCompensation, testing::Values("kodim08.png", "StillLife.exr", "kodim23.png"));

}  // namespace
}  // namespace lowlux
