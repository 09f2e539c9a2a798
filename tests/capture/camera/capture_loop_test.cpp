#include "capture/camera/capture_loop.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>

#include "tests/support/fake_camera.h"

namespace lowlux {
namespace {

using capture::CameraFrame;
using capture::LoopCount;
using capture::LoopLimits;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

class CaptureLoop : public testing::Test {
 protected:
  Result<void> run(const LoopLimits& limits) {
    return capture::capture_frames(
        camera_, limits, stop_,
        [&](const CameraFrame& frame) {
          sequences_.push_back(frame.sequence);
          return work_(frame);
        },
        [&](const LoopCount& count) { watch_(count); }, count_, check_);
  }
  void deliver(std::uint32_t sequence, std::uint32_t lost = 0, bool damaged = false) {
    CameraFrame frame = camera_.frame();
    frame.sequence = sequence;
    frame.lost_before = lost;
    frame.damaged = damaged;
    camera_.deliver(frame);
  }

  test::FakeCamera camera_{{.raw = {}, .width = 4, .height = 2, .stride_bytes = 8, .frame_rate_hz = {}}};
  std::atomic<bool> stop_{false};
  LoopCount count_;
  std::vector<std::uint32_t> sequences_;
  std::function<Result<bool>(const CameraFrame&)> work_ = [](const CameraFrame&) { return true; };
  std::function<void(const LoopCount&)> watch_ = [](const LoopCount&) {};
  capture::FrameCheck check_;
};

TEST_F(CaptureLoop, TakesAsManyWholeFramesAsAskedForAfterThoseLeftOut) {
  deliver(0);
  deliver(1, 0, true);
  deliver(4, 2);
  deliver(5, 0, true);
  deliver(6);
  deliver(7);
  ASSERT_TRUE(run({.frames = 2, .skip = 1}));
  EXPECT_EQ(sequences_, (std::vector<std::uint32_t>{4, 6}));
  EXPECT_EQ(count_.taken, 2u);
  EXPECT_EQ(count_.skipped, 1u);
  EXPECT_EQ(count_.damaged, 2u);
  EXPECT_EQ(count_.lost, 2u);
  EXPECT_FALSE(count_.stopped);
  EXPECT_EQ(camera_.lent, 5);
  EXPECT_EQ(camera_.returned, 5);
  EXPECT_EQ(camera_.stops, 1);
}

TEST_F(CaptureLoop, WaitsThroughPausesShorterThanTheLimit) {
  deliver(0);
  camera_.events.emplace_back();
  camera_.events.emplace_back();
  deliver(1);
  ASSERT_TRUE(run({.frames = 2}));
  EXPECT_EQ(count_.taken, 2u);
  EXPECT_LE(camera_.longest_wait, milliseconds(100));  // so that a signal is seen
  EXPECT_GT(count_.wait_s, 0.15);                      // two waits of 0.1 s, less what clocks and sleeps round
  EXPECT_GE(count_.seconds, count_.wait_s);
}

TEST_F(CaptureLoop, SaysThatNoFrameCameOnceTheLimitIsOver) {
  const auto start = steady_clock::now();
  const auto done = run({.timeout = milliseconds(150)});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::insufficient);
  EXPECT_NE(done.error().message.find("no frame came within 0.15 s"), std::string::npos) << done.error().message;
  EXPECT_EQ(done.error().where, "fake");
  EXPECT_LT(steady_clock::now() - start, std::chrono::seconds(2));
  EXPECT_EQ(camera_.stops, 1);
}

TEST_F(CaptureLoop, DoesNotTakeDamagedFramesForASignOfLife) {
  for (std::uint32_t i = 0; i < 4; ++i) {
    deliver(i, 0, true);
    camera_.events.emplace_back();
  }
  const auto done = run({.timeout = milliseconds(250)});
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("no whole frame"), std::string::npos) << done.error().message;
  EXPECT_TRUE(sequences_.empty());
  EXPECT_EQ(camera_.returned, camera_.lent);
}

TEST_F(CaptureLoop, EndsWithTheErrorOfACameraThatVanishes) {
  deliver(0);
  camera_.events.emplace_back(fail(ErrorCode::not_found, "the device is gone", "fake"));
  deliver(1);
  const auto done = run({.frames = 0});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::not_found);
  EXPECT_EQ(count_.taken, 1u);
  EXPECT_EQ(camera_.stops, 1);
}

TEST_F(CaptureLoop, EndsWithTheErrorOfACameraThatDoesNotStart) {
  camera_.refusal = Error{ErrorCode::unreadable, "busy", "fake"};
  const auto done = run({});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "busy");
  EXPECT_EQ(camera_.lent, 0);
}

TEST_F(CaptureLoop, FinishesTheFrameAtWorkWhenAskedToStop) {
  for (std::uint32_t i = 0; i < 5; ++i) deliver(i);
  work_ = [&](const CameraFrame& frame) {
    if (frame.sequence == 2) stop_ = true;
    return true;
  };
  ASSERT_TRUE(run({.frames = 0}));
  EXPECT_TRUE(count_.stopped);
  EXPECT_EQ(count_.taken, 3u);
  EXPECT_EQ(camera_.returned, 3);
  EXPECT_EQ(camera_.stops, 1);
}

TEST_F(CaptureLoop, StopsWithoutWaitingForAFrameThatDoesNotCome) {
  deliver(0);
  watch_ = [&](const LoopCount&) { stop_ = true; };
  const auto start = steady_clock::now();
  ASSERT_TRUE(run({.frames = 0, .timeout = std::chrono::seconds(60)}));
  EXPECT_TRUE(count_.stopped);
  EXPECT_LT(steady_clock::now() - start, std::chrono::seconds(2));
}

TEST_F(CaptureLoop, EndsWhenNoMoreFramesAreWanted) {
  for (std::uint32_t i = 0; i < 3; ++i) deliver(i);
  work_ = [](const CameraFrame& frame) { return frame.sequence == 0; };
  ASSERT_TRUE(run({.frames = 0}));
  EXPECT_EQ(count_.taken, 1u);  // the second was not wanted any more
  EXPECT_FALSE(count_.stopped);
  EXPECT_EQ(camera_.returned, 2);
}

TEST_F(CaptureLoop, GivesAFrameBackWhoseWorkFails) {
  deliver(0);
  work_ = [](const CameraFrame&) -> Result<bool> { return fail(ErrorCode::unwritable, "the disk is full", "a.png"); };
  const auto done = run({});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().where, "a.png");
  EXPECT_EQ(count_.taken, 0u);
  EXPECT_EQ(camera_.returned, 1);
  EXPECT_EQ(camera_.stops, 1);
}

TEST_F(CaptureLoop, LeavesOutWhatTheCheckDoesNotPassAndPassesOnWhatItCompletes) {
  for (const std::uint32_t sequence : {0U, 1U, 2U, 3U, 4U}) deliver(sequence, 0, sequence == 1);
  std::vector<std::uint32_t> checked;
  check_ = [&](CameraFrame& frame) -> Result<bool> {
    checked.push_back(frame.sequence);
    frame.facts.exposure_s = 0.25;
    return frame.sequence >= 2;
  };
  work_ = [&](const CameraFrame& frame) {
    EXPECT_EQ(frame.facts.exposure_s, 0.25);
    return true;
  };
  ASSERT_TRUE(run({.frames = 2}));
  EXPECT_EQ(checked, (std::vector<std::uint32_t>{0, 2, 3}));  // not the damaged one
  EXPECT_EQ(sequences_, (std::vector<std::uint32_t>{2, 3}));
  EXPECT_EQ(count_.skipped, 1u);
}

TEST_F(CaptureLoop, EndsWithTheErrorOfTheCheckAndGivesTheFrameBack) {
  deliver(0);
  check_ = [](CameraFrame&) -> Result<bool> { return fail(ErrorCode::unreadable, "no exposure", "fake"); };
  const auto done = run({});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "no exposure");
  EXPECT_EQ(camera_.returned, 1);
  EXPECT_TRUE(sequences_.empty());
}

}  // namespace
}  // namespace lowlux
