#include "capture/libcamera/request_camera.h"

#include <cerrno>
#include <chrono>
#include <deque>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "tests/capture/camera/stand_in_device.h"

namespace lowlux::capture {
namespace {

using std::chrono::milliseconds;

std::unique_ptr<RequestCamera> camera_of(Script& script) {
  return std::make_unique<RequestCamera>(OpenRequestDevice{
      .completions = script.completions,
      .device = std::make_unique<StandIn>(script),
      .name = "stand-in",
      .format = {.raw = {.bits = 10}, .width = 6, .height = 4, .stride_bytes = stride_bytes, .frame_rate_hz = {}},
      .warnings = {"one"},
      .buffers = buffer_count});
}

ErrorCode code_of(const Result<CameraFrame>& frame) { return frame ? ErrorCode::exists : frame.error().code; }

TEST(RequestCamera, StartsWithAllBuffersQueuedAndDeliversWhatCompletes) {
  Script script;
  const auto camera = camera_of(script);
  EXPECT_EQ(camera->name(), "stand-in");
  EXPECT_EQ(camera->format().width, 6);
  EXPECT_EQ(camera->warnings(), std::vector<std::string>{"one"});
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(camera->start());  // once is enough
  EXPECT_EQ(script.starts, 1);
  EXPECT_EQ(script.queued, (std::deque<int>{0, 1, 2}));
  script.complete(7);
  const auto frame = camera->next(milliseconds(0));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->bytes.data(), script.memory[0].data());
  EXPECT_EQ(frame->bytes.size(), needed_bytes);  // the last row without its padding
  EXPECT_EQ(frame->sequence, 7U);
  EXPECT_EQ(frame->lost_before, 0U);
  EXPECT_EQ(frame->timestamp, milliseconds(71));
  EXPECT_EQ(frame->facts.exposure_s, 0.5);
  EXPECT_FALSE(frame->damaged);
  EXPECT_EQ(script.readings, 1);
  camera->return_buffer(*frame);
  EXPECT_EQ(script.readings, 0);
  EXPECT_EQ(script.queued, (std::deque<int>{1, 2, 0}));
}

TEST(RequestCamera, CountsWhatIsMissingAlsoWhereTheCounterWrapsAround) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  struct Step {
    std::uint32_t sequence, lost;
  };
  for (const Step step : {Step{5, 0}, Step{6, 0}, Step{9, 2}, Step{9, 0}, Step{3, 0}, Step{4, 0},
                          Step{0x80000003U, 0x7ffffffeU}, Step{0xfffffffeU, 0x7ffffffaU}, Step{1, 2}}) {
    script.complete(step.sequence);
    const auto frame = camera->next(milliseconds(0));
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->lost_before, step.lost) << step.sequence;
    camera->return_buffer(*frame);
  }
}

TEST(RequestCamera, FramesOfTheStartAreDroppedAndNotCountedAsLost) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0, CompletionState::startup);
  script.complete(1, CompletionState::startup);
  script.complete(2);
  const auto frame = camera->next(milliseconds(1000));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->sequence, 2U);
  EXPECT_EQ(frame->lost_before, 0U);
  EXPECT_EQ(script.queued, (std::deque<int>{0, 1}));
  script.complete(3, CompletionState::startup);
  EXPECT_EQ(code_of(camera->next(milliseconds(0))), ErrorCode::insufficient);
}

TEST(RequestCamera, DamagedShortAndStaleFramesAreMarked) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0, CompletionState::damaged);
  EXPECT_TRUE(camera->next(milliseconds(0))->damaged);
  script.complete(1, CompletionState::filled, needed_bytes - 1);
  EXPECT_TRUE(camera->next(milliseconds(0))->damaged);
  script.readable = false;
  script.complete(2);
  EXPECT_TRUE(camera->next(milliseconds(0))->damaged);
}

TEST(RequestCamera, NoFrameInTimeIsAnErrorThatSaysWhereTheBuffersAre) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  const auto none = camera->next(milliseconds(5));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::insufficient);
  EXPECT_EQ(none.error().message, "no frame came within 5 ms");
  EXPECT_EQ(code_of(camera->next(milliseconds(-5))), ErrorCode::insufficient);
  for (std::uint32_t i = 0; i < buffer_count; ++i) script.complete(i);
  for (int i = 0; i < buffer_count; ++i) ASSERT_TRUE(camera->next(milliseconds::max()));
  const auto held = camera->next(milliseconds(0));
  ASSERT_FALSE(held);
  EXPECT_EQ(held.error().message, "no frame came within 0 ms: all 3 buffers are lent, give one back");
}

TEST(RequestCamera, AFrameIsGivenBackOnceAndOnlyToItsStream) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0);
  const CameraFrame frame = *camera->next(milliseconds(0));
  camera->return_buffer(frame);
  camera->return_buffer(frame);
  EXPECT_EQ(script.queued.size(), 3U);
  EXPECT_EQ(script.readings, 0);
  CameraFrame foreign = frame;
  for (const int buffer : {-1, buffer_count, 1}) {
    foreign.buffer = buffer;
    camera->return_buffer(foreign);
  }
  EXPECT_EQ(script.queued.size(), 3U);
}

TEST(RequestCamera, StopVoidsLentFramesAndStartBeginsAnew) {
  Script script;
  const auto camera = camera_of(script);
  camera->stop();
  EXPECT_EQ(script.stops, 0);  // nothing to stop
  ASSERT_TRUE(camera->start());
  script.complete(8);
  script.complete(9);
  const CameraFrame lent = *camera->next(milliseconds(0));
  camera->stop();
  EXPECT_EQ(script.stops, 1);
  EXPECT_EQ(script.readings, 0);
  camera->return_buffer(lent);
  EXPECT_TRUE(script.queued.empty());
  ASSERT_TRUE(camera->start());
  EXPECT_EQ(script.queued, (std::deque<int>{0, 1, 2}));
  EXPECT_EQ(code_of(camera->next(milliseconds(0))), ErrorCode::insufficient);  // neither 9 nor what was cancelled
  script.complete(0);
  EXPECT_EQ(camera->next(milliseconds(0))->lost_before, 0U);
}

TEST(RequestCamera, ADeviceThatDoesNotStartSaysWhy) {
  struct Case {
    int result;
    ErrorCode code;
    const char* message;
  };
  for (const Case& one : {Case{-EBUSY, ErrorCode::unreadable, "cannot start the camera: another program uses it"},
                          Case{-ENODEV, ErrorCode::not_found, "the camera is no longer available: was it unplugged?"},
                          Case{-EPIPE, ErrorCode::unreadable, "cannot start the camera: Broken pipe"}}) {
    Script script;
    script.start_result = one.result;
    const auto camera = camera_of(script);
    const auto started = camera->start();
    ASSERT_FALSE(started);
    EXPECT_EQ(started.error().code, one.code);
    EXPECT_EQ(started.error().message, one.message);
    EXPECT_EQ(started.error().where, "stand-in");
    EXPECT_EQ(script.stops, 0);
  }
}

TEST(RequestCamera, ABufferRefusedAtTheStartStopsTheStream) {
  Script script;
  script.queue_result = -EINVAL;
  const auto camera = camera_of(script);
  ASSERT_FALSE(camera->start());
  EXPECT_EQ(script.stops, 1);
  script.queue_result = 0;
  EXPECT_TRUE(camera->start());
}

TEST(RequestCamera, ABufferRefusedLaterIsReportedOnceNothingElseCompletes) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0);
  const CameraFrame frame = *camera->next(milliseconds(0));
  script.complete(1);
  script.queue_result = -EINVAL;
  camera->return_buffer(frame);
  EXPECT_TRUE(camera->next(milliseconds(0)));
  EXPECT_EQ(code_of(camera->next(milliseconds(0))), ErrorCode::unreadable);
}

TEST(RequestCamera, AnUnpluggedCameraStaysDead) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0);
  script.completions->set_disconnected();
  EXPECT_TRUE(camera->next(milliseconds(0)));  // it was there before
  EXPECT_EQ(code_of(camera->next(milliseconds::max())), ErrorCode::not_found);
  camera->stop();
  EXPECT_EQ(camera->start().error().code, ErrorCode::not_found);
  EXPECT_EQ(script.starts, 1);
}

TEST(RequestCamera, ABufferRefusedForWantOfTheDeviceMeansThatItIsGone) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0);
  const CameraFrame frame = *camera->next(milliseconds(0));
  script.queue_result = -ENODEV;
  camera->return_buffer(frame);
  EXPECT_EQ(code_of(camera->next(milliseconds::max())), ErrorCode::not_found);
}

TEST(RequestCamera, CancelledFramesEndTheStreamOrTellThatTheCameraIsGone) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  script.complete(0, CompletionState::cancelled);
  const auto ended = camera->next(milliseconds(0));
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, ErrorCode::unreadable);
  EXPECT_EQ(ended.error().message, "the camera ended the stream: start it again");
  script.complete(1, CompletionState::cancelled);
  script.completions->set_disconnected();
  EXPECT_EQ(code_of(camera->next(milliseconds(0))), ErrorCode::not_found);
}

TEST(RequestCamera, AFrameOrUnpluggingOfAnotherThreadEndsTheWait) {
  Script script;
  const auto camera = camera_of(script);
  ASSERT_TRUE(camera->start());
  std::thread completes([&] { script.complete(0); });
  EXPECT_TRUE(camera->next(std::chrono::hours(1)));
  completes.join();
  std::thread unplugs([&] { script.completions->set_disconnected(); });
  EXPECT_EQ(code_of(camera->next(std::chrono::hours(1))), ErrorCode::not_found);
  unplugs.join();
}

TEST(RequestCamera, LeavesNothingOpenWhateverItsState) {
  for (const int frames : {-1, 0, 1, 2}) {
    Script script;
    {
      const auto camera = camera_of(script);
      if (frames >= 0) {
        ASSERT_TRUE(camera->start());
      }
      for (int i = 0; i < frames; ++i) {
        script.complete(static_cast<std::uint32_t>(i));
        ASSERT_TRUE(camera->next(milliseconds(0)));
      }
    }
    EXPECT_EQ(script.stops, frames >= 0 ? 1 : 0) << frames;
    EXPECT_EQ(script.readings, 0) << frames;
    EXPECT_FALSE(script.alive) << frames;
  }
}

TEST(CompletionQueue, HoldsOneCompletionOfEachBufferAndNoMore) {
  CompletionQueue queue(2);
  for (int i = 0; i < 5; ++i) queue.push({.buffer = i});
  EXPECT_EQ(queue.take({})->buffer, 0);
  EXPECT_EQ(queue.take({})->buffer, 1);
  EXPECT_FALSE(queue.take({}));
}

TEST(RequestCamera, PassesTheExposureOnAndTheErrorOfACameraWithout) {
  Script script;
  const auto camera = camera_of(script);
  EXPECT_FALSE(camera->take_exposure());
  script.exposure_controls = ExposureControls{.min_s = 0.001, .max_s = 1};
  EXPECT_EQ(camera->take_exposure()->max_s, 1);
  EXPECT_EQ(camera->set_exposure({.exposure_s = 0.25}).value(), 0.25);
  ASSERT_EQ(script.exposures.size(), 1u);
  EXPECT_EQ(script.exposures[0].exposure_s, 0.25);
  script.completions->set_disconnected();
  EXPECT_EQ(camera->set_exposure({.exposure_s = 0.5}).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace lowlux::capture
