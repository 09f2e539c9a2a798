#include <gtest/gtest.h>
#include <linux/dma-buf.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <cerrno>
#include <chrono>
#include <string>

#include "capture/v4l2/v4l2_negotiation.h"
#include "tests/capture/camera/v4l2_opened.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::test {
namespace {

using capture::Camera;
using capture::CameraFrame;
using capture::V4l2Memory;
using std::chrono::milliseconds;

constexpr milliseconds second{1000};
constexpr std::uint32_t monotonic = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;

TEST(V4l2Stream, DeliversTheBytesOfTheDriversBuffersByBothWaysAndBothInterfaces) {
  for (const bool multi_planar : {false, true}) {
    for (const V4l2Memory memory : {V4l2Memory::mmap, V4l2Memory::dma_buf}) {
      FakeV4l2 fake(multi_planar);
      for (std::uint32_t i = 0; i < 9; ++i) fake.frames.push_back({.sequence = i + 5});
      {
        const auto camera = started(fake, {.memory = memory});
        for (std::uint32_t i = 0; i < 9; ++i) {
          const CameraFrame frame = camera->next(second).value();
          ASSERT_EQ(frame.bytes.size(), capture::frame_bytes(camera->format()));
          EXPECT_EQ(frame.bytes.front(), static_cast<std::byte>(i + 5));
          EXPECT_EQ(frame.bytes.back(), static_cast<std::byte>((frame.bytes.size() - 1) * 7 + i + 5));
          EXPECT_EQ(frame.sequence, i + 5);
          EXPECT_EQ(frame.lost_before, 0u);
          EXPECT_EQ(frame.timestamp, std::chrono::microseconds(12'345'678));
          EXPECT_FALSE(frame.damaged);
          EXPECT_EQ(fake.accesses, memory == V4l2Memory::dma_buf ? 1 : 0);
          camera->return_buffer(frame);
          EXPECT_EQ(fake.queued(), 4u);
        }
      }
      expect_clean(fake);
    }
  }
}

TEST(V4l2Stream, AFrameMayBeginInsideItsBufferOnlyAsFarAsItFits) {
  FakeV4l2 fake(true);
  fake.buffer_length = 72 * 24 + 100;
  const std::uint32_t room = 100 + 8;  // the last row is not padded
  fake.frames = {{.sequence = 0, .data_offset = room}, {.sequence = 1, .data_offset = room + 1}, {.sequence = 2}};
  const auto camera = started(fake);
  const CameraFrame frame = camera->next(second).value();
  EXPECT_EQ(frame.bytes.front(), static_cast<std::byte>(room * 7));
  EXPECT_FALSE(frame.damaged);
  EXPECT_EQ(camera->next(second).error().code, ErrorCode::malformed);
  EXPECT_EQ(fake.queued(), 3u);  // the driver has it back
  EXPECT_EQ(camera->next(second).value().sequence, 2u);
}

TEST(V4l2Stream, ShortAndFaultyFramesAreDamagedAndReadable) {
  FakeV4l2 fake;
  const std::uint32_t whole = 72 * 23 + 64;
  fake.frames = {{.bytes_used = whole},
                 {.bytes_used = whole - 1},
                 {.bytes_used = 0},
                 {.flags = monotonic | V4L2_BUF_FLAG_ERROR},
                 {.bytes_used = 72 * 24 + 1}};
  const auto camera = started(fake);
  for (const bool damaged : {false, true, true, true}) {
    const CameraFrame frame = camera->next(second).value();
    EXPECT_EQ(frame.damaged, damaged);
    EXPECT_EQ(frame.bytes.size(), whole);
    camera->return_buffer(frame);
  }
  const Error lie = camera->next(second).error();
  EXPECT_EQ(lie.code, ErrorCode::malformed);
  EXPECT_TRUE(has(lie, "1729 bytes, from byte 0 on, are in a buffer of 1728")) << lie.message;
}

TEST(V4l2Stream, GapsAreCountedAcrossTheWrapAndRepeatsAndStepsBackAreNone) {
  struct Step {
    std::uint32_t sequence, lost;
  };
  const Step steps[] = {{7, 0},
                        {8, 0},
                        {11, 2},
                        {11, 0},
                        {9, 0},
                        {10, 0},
                        {0xFFFFFFFE, 0},
                        {0xFFFFFFFF, 0},
                        {0, 0},
                        {3, 2},
                        {0x80000003, 0x7FFFFFFF},
                        {4, 0},
                        {0xFFFFFFFF, 0},
                        {1, 1}};
  FakeV4l2 fake;
  for (const Step& step : steps) fake.frames.push_back({.sequence = step.sequence});
  const auto camera = started(fake);
  for (const Step& step : steps) {
    const CameraFrame frame = camera->next(second).value();
    EXPECT_EQ(frame.lost_before, step.lost) << step.sequence;
    camera->return_buffer(frame);
  }
  // A new start counts anew.
  camera->stop();
  fake.frames = {{.sequence = 100}};
  ASSERT_TRUE(camera->start());
  EXPECT_EQ(camera->next(second).value().lost_before, 0u);
}

TEST(V4l2Stream, TimesOfAnotherClockAreDroppedWithOneWarning) {
  FakeV4l2 fake;
  fake.frames = {{.flags = monotonic},
                 {.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN},
                 {.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY},
                 {.seconds = -1},
                 {.seconds = 9'000'000'000},
                 {.microseconds = 1'000'000},
                 {.microseconds = -1}};
  const auto camera = started(fake);
  for (const std::size_t warnings : {0, 1, 1, 1, 1, 1, 1}) {
    const CameraFrame frame = camera->next(second).value();
    EXPECT_EQ(frame.timestamp == milliseconds(0), warnings == 1);
    EXPECT_EQ(camera->warnings().size(), warnings);
    camera->return_buffer(frame);
  }
}

TEST(V4l2Stream, ATimeOutComesInTimeAndTheStreamGoesOn) {
  FakeV4l2 fake;
  const auto camera = started(fake);
  const Error late = camera->next(milliseconds(1700)).error();
  EXPECT_EQ(late.code, ErrorCode::insufficient);
  EXPECT_EQ(fake.now_ms, 1700);
  EXPECT_EQ(camera->next(milliseconds(-5)).error().code, ErrorCode::insufficient);
  EXPECT_EQ(camera->next(milliseconds::min()).error().code, ErrorCode::insufficient);
  EXPECT_EQ(fake.now_ms, 1700);
  fake.frames = {{.sequence = 3}};
  EXPECT_EQ(camera->next(milliseconds::max()).value().sequence, 3u);
}

TEST(V4l2Stream, ASignalDoesNotEndAWaitAndAnotherFailureOfItDoes) {
  FakeV4l2 fake;
  const auto camera = started(fake);
  fake.poll_errno = EINTR;
  EXPECT_EQ(camera->next(milliseconds(1000)).error().code, ErrorCode::insufficient);
  EXPECT_GE(fake.now_ms, 1000);
  fake.poll_errno = ENOMEM;
  EXPECT_TRUE(has(camera->next(second).error(), "waiting for a frame failed"));
}

TEST(V4l2Stream, AFrameThatIsAnnouncedAndNotThereIsWaitedForWithoutSpinning) {
  FakeV4l2 fake;
  const auto camera = started(fake);
  fake.poll_answer = POLLIN;
  EXPECT_EQ(camera->next(second).error().code, ErrorCode::insufficient);
  EXPECT_LT(fake.calls[VIDIOC_DQBUF], 2100);  // twice a millisecond
}

TEST(V4l2GiveBack, FramesOfAnEarlierStartAndFramesGivenTwiceAreLeftAlone) {
  FakeV4l2 fake;
  fake.frames = {{.sequence = 1}, {.sequence = 2}};
  const auto camera = started(fake, {.memory = V4l2Memory::dma_buf});
  const CameraFrame old = camera->next(second).value();
  const CameraFrame held = camera->next(second).value();
  camera->return_buffer(held);
  camera->return_buffer(held);
  EXPECT_EQ(fake.queued(), 3u);
  camera->stop();
  camera->return_buffer(old);
  fake.frames = {{.sequence = 1}};
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(camera->start());  // has been
  const CameraFrame fresh = camera->next(second).value();
  camera->return_buffer(old);
  EXPECT_EQ(fake.queued(), 3u);  // the fresh one is still ours
  CameraFrame foreign = fresh;
  for (const int buffer : {-1, fresh.buffer + 9, fresh.buffer + 1000}) {
    foreign.buffer = buffer;
    camera->return_buffer(foreign);
  }
  EXPECT_EQ(fake.queued(), 3u);
  EXPECT_EQ(fake.misuses, 0);
}

TEST(V4l2GiveBack, WithAllBuffersOutNoFrameIsWaitedFor) {
  FakeV4l2 fake;
  fake.frames = {{}, {}, {}};
  const auto camera = started(fake, {.request = {.buffers = 2}});
  const CameraFrame first = camera->next(second).value();
  EXPECT_TRUE(camera->next(second));
  EXPECT_TRUE(has(camera->next(second).error(), "all 2 buffers are in use"));
  EXPECT_EQ(fake.now_ms, 0);
  camera->return_buffer(first);
  EXPECT_TRUE(camera->next(second));
}

TEST(V4l2GiveBack, WhatTheDriverDoesNotTakeBackIsTheNextError) {
  for (const unsigned long request : {static_cast<unsigned long>(VIDIOC_QBUF), DMA_BUF_IOCTL_SYNC}) {
    FakeV4l2 fake;
    fake.frames = {{}, {}};
    const auto camera = started(fake, {.memory = V4l2Memory::dma_buf});
    const CameraFrame frame = camera->next(second).value();
    fake.faults[request] = {EIO, 1};
    camera->return_buffer(frame);
    EXPECT_EQ(camera->next(second).error().code, ErrorCode::unreadable);
    camera->stop();
    ASSERT_TRUE(camera->start());
    EXPECT_TRUE(camera->next(second));
  }
}

TEST(V4l2DmaBuf, SynchronisationIsRepeatedWhereTheKernelAsksForItAndItsFailureIsNoFrame) {
  FakeV4l2 fake;
  fake.frames = {{}, {}, {}};
  const auto camera = started(fake, {.memory = V4l2Memory::dma_buf});
  fake.faults[DMA_BUF_IOCTL_SYNC] = {EAGAIN, 5};
  EXPECT_TRUE(camera->next(second));
  fake.faults[DMA_BUF_IOCTL_SYNC] = {EIO, 1};
  EXPECT_TRUE(has(camera->next(second).error(), "DMA buffer"));
  EXPECT_EQ(fake.queued(), 3u);
  EXPECT_TRUE(camera->next(second));
}

TEST(V4l2System, OfThisMachineMapsWaitsAndTellsTime) {
  const ScratchDirectory scratch;
  scratch.write("bytes", "seven");
  const capture::V4l2System system = capture::v4l2_system();
  const int file = system.open(nullptr, scratch.file("bytes").c_str());
  ASSERT_GE(file, 0);
  void* at = system.map(nullptr, file, 5, 0);
  ASSERT_NE(at, nullptr);
  EXPECT_EQ(std::string(static_cast<const char*>(at), 5), "seven");
  EXPECT_EQ(system.unmap(nullptr, at, 5), 0);
  EXPECT_EQ(system.map(nullptr, file, 5, 1), nullptr);  // not at a page
  EXPECT_EQ(errno, EINVAL);
  short happened = 0;
  EXPECT_EQ(system.poll(nullptr, file, POLLIN, 0, &happened), 1);  // files are always ready
  EXPECT_EQ(happened, POLLIN);
  EXPECT_EQ(system.close(nullptr, file), 0);
  const auto before = system.now(nullptr);
  EXPECT_GE(system.now(nullptr), before);
}

}  // namespace
}  // namespace lowlux::test
