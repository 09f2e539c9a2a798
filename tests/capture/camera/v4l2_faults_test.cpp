#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

#include "tests/capture/camera/v4l2_opened.h"

namespace lowlux::test {
namespace {

using capture::Camera;
using capture::CameraFrame;
using capture::V4l2Memory;
using std::chrono::milliseconds;

constexpr milliseconds second{1000};

/// The error of start(), after which no memory may be left.
Error not_started(FakeV4l2& fake, const capture::V4l2Options& options = {}) {
  const auto camera = opened(fake, options);
  const auto start = camera->start();
  EXPECT_FALSE(start);
  EXPECT_EQ(fake.open_files, 1);
  EXPECT_EQ(fake.open_maps, 0);
  EXPECT_EQ(fake.misuses, 0);
  EXPECT_FALSE(fake.is_streaming);
  const auto frame = camera->next(second);
  EXPECT_FALSE(frame);
  return start ? Error{} : start.error();
}

TEST(V4l2Stream, FailuresOfADequeueAreToldApart) {
  struct Case {
    int code;
    ErrorCode error;
    const char* words;
  };
  for (const Case& one : {Case{EIO, ErrorCode::unreadable, "the next frame cannot be read"},
                          Case{ENODEV, ErrorCode::not_found, "the device is no longer available: Fake Camera?"},
                          Case{EINVAL, ErrorCode::unreadable, "Invalid argument"}}) {
    FakeV4l2 fake;
    const auto camera = started(fake);
    fake.faults[VIDIOC_DQBUF] = {one.code, 1};
    const Error error = camera->next(second).error();
    EXPECT_EQ(error.code, one.error);
    EXPECT_TRUE(has(error, one.words)) << error.message;
    fake.frames = {{}};
    EXPECT_EQ(camera->next(second).has_value(), one.code != ENODEV);  // gone is for ever
  }
  for (const std::uint32_t index : {1u, 4u, 0xFFFFFFFFu}) {  // 1: the application has it
    FakeV4l2 fake;
    const auto camera = started(fake);
    fake.frames = {{}, {}, {.index = index}};
    EXPECT_TRUE(camera->next(second));
    EXPECT_TRUE(camera->next(second));
    EXPECT_EQ(camera->next(second).error().code, ErrorCode::malformed) << index;
  }
}

TEST(V4l2Stream, ADriverThatStoppedByItselfIsNoEndlessWait) {
  FakeV4l2 fake;
  const auto camera = started(fake);
  fake.poll_answer = POLLERR;
  EXPECT_TRUE(has(camera->next(second).error(), "has stopped streaming"));
  EXPECT_EQ(fake.now_ms, 0);
}

TEST(V4l2Stream, UnpluggingIsSeenWithinHalfASecondHoweverTheDriverTells) {
  for (const bool wakes : {true, false}) {
    FakeV4l2 fake;
    {
      const auto camera = started(fake);
      fake.unplugged = true;
      fake.wakes_on_unplugging = wakes;
      fake.faults[VIDIOC_DQBUF] = {EAGAIN, 1, 0};
      EXPECT_EQ(camera->next(second * 60).error().code, ErrorCode::not_found);
      EXPECT_LE(fake.now_ms, 500);
      EXPECT_EQ(camera->next(second).error().code, ErrorCode::not_found);
      camera->stop();
      EXPECT_EQ(camera->next(second).error().code, ErrorCode::not_found);
      EXPECT_EQ(camera->start().error().code, ErrorCode::not_found);
    }
    expect_clean(fake);
  }
  FakeV4l2 fake;
  const auto camera = started(fake);
  fake.poll_answer = POLLHUP;  // the wait alone tells
  EXPECT_EQ(camera->next(second).error().code, ErrorCode::not_found);
  fake.poll_answer = 0;
  EXPECT_EQ(camera->next(second).error().code, ErrorCode::not_found);
}

TEST(V4l2Stream, UnpluggingDuringAnyCallOfAStreamIsGoneAndLeavesNothing) {
  for (const V4l2Memory memory : {V4l2Memory::mmap, V4l2Memory::dma_buf}) {
    for (int calls = 0;; ++calls) {
      FakeV4l2 fake;
      fake.frames = {{}, {}, {}};
      bool is_over = false;
      {
        const auto camera = opened(fake, {.memory = memory});
        fake.calls_before_unplugging = calls;
        auto error = camera->start();
        for (int i = 0; error && i < 3; ++i) {
          const auto frame = camera->next(second);
          if (frame) {
            camera->return_buffer(*frame);
          } else {
            error = tl::make_unexpected(frame.error());
          }
        }
        is_over = error.has_value();
        if (!error) {
          EXPECT_EQ(error.error().code, ErrorCode::not_found) << calls << ": " << error.error().message;
        }
      }
      expect_clean(fake);
      if (is_over) break;
    }
  }
}

TEST(V4l2Start, EachRefusalHasItsReasonAndTakesNothing) {
  struct Case {
    unsigned long request;
    FakeV4l2::Fault fault;
    ErrorCode code;
    const char* words;
  };
  const Case cases[] = {{VIDIOC_REQBUFS, {EBUSY}, ErrorCode::unreadable, "another program uses the device"},
                        {VIDIOC_REQBUFS, {ENOMEM}, ErrorCode::too_large, "fewer buffers"},
                        {VIDIOC_REQBUFS, {EINVAL}, ErrorCode::unreadable, "gives no buffers"},
                        {VIDIOC_QUERYBUF, {EINVAL, 9, 2}, ErrorCode::unreadable, "does not describe its buffer"},
                        {VIDIOC_G_FMT, {EIO}, ErrorCode::unreadable, "does not state its format"},
                        {VIDIOC_QBUF, {EIO, 9, 3}, ErrorCode::unreadable, "takes no buffer"},
                        {VIDIOC_STREAMON, {EPIPE}, ErrorCode::unreadable, "set the sensor's format with media-ctl"},
                        {VIDIOC_STREAMON, {ENOSPC}, ErrorCode::unreadable, "bandwidth"},
                        {VIDIOC_STREAMON, {EBUSY}, ErrorCode::unreadable, "another program uses the device"},
                        {VIDIOC_STREAMON, {EIO}, ErrorCode::unreadable, "streaming does not start"},
                        {VIDIOC_EXPBUF, {ENOTTY}, ErrorCode::unsupported, "exports no DMA buffers"},
                        {VIDIOC_EXPBUF, {EMFILE, 9, 2}, ErrorCode::unreadable, "does not export its buffer"}};
  for (const Case& one : cases) {
    FakeV4l2 fake;
    const V4l2Memory memory = one.request == VIDIOC_EXPBUF ? V4l2Memory::dma_buf : V4l2Memory::mmap;
    {
      const auto camera = opened(fake, {.memory = memory});
      fake.faults[one.request] = one.fault;
      const auto start = camera->start();
      ASSERT_FALSE(start) << one.words;
      EXPECT_EQ(start.error().code, one.code);
      EXPECT_TRUE(has(start.error(), one.words)) << start.error().message;
      EXPECT_EQ(fake.open_files, 1);
      EXPECT_EQ(fake.open_maps, 0);
      EXPECT_EQ(camera->next(second).error().code, ErrorCode::insufficient);  // not started
      fake.faults.clear();
      EXPECT_TRUE(camera->start()) << one.words;  // what passed passes
    }
    expect_clean(fake);
  }
}

TEST(V4l2Start, MemoryIsMappedWholeAndBoundedOrNotAtAll) {
  for (const V4l2Memory memory : {V4l2Memory::mmap, V4l2Memory::dma_buf}) {
    FakeV4l2 fake;
    fake.map_errno = EACCES;
    EXPECT_TRUE(has(not_started(fake, {.memory = memory}), "cannot be mapped"));
  }
  for (const std::uint32_t given : {0u, 33u}) {
    FakeV4l2 fake;
    fake.buffers_given = given;
    EXPECT_EQ(not_started(fake).code, ErrorCode::malformed) << given;
  }
  FakeV4l2 fake;
  fake.buffer_length = 72 * 23 + 63;  // a byte less than a frame
  EXPECT_EQ(not_started(fake).code, ErrorCode::malformed);
  fake.stated_length = (2u << 30) / 4 + 1;  // four of them are over 2 GiB
  EXPECT_EQ(not_started(fake).code, ErrorCode::too_large);
  fake.stated_length.reset();
  fake.buffer_length = 72 * 23 + 64;
  fake.buffers_given = 32;
  fake.frames = {{}};
  const auto camera = started(fake);
  EXPECT_EQ(fake.queued(), 32u);
  EXPECT_TRUE(camera->next(second));
}

TEST(V4l2Start, AFormatThatAnotherProgramChangedMeanwhileIsSeen) {
  FakeV4l2 fake;
  const auto camera = opened(fake);
  fake.layout.fourcc = V4L2_PIX_FMT_SRGGB8;
  const Error error = camera->start().error();
  EXPECT_EQ(error.code, ErrorCode::unreadable);
  EXPECT_TRUE(has(error, "another program changed the format to SRGGB8 32x24")) << error.message;
  EXPECT_EQ(fake.open_maps, 0);
}

TEST(V4l2Start, ASecondCameraOfARunningDeviceIsBusy) {
  FakeV4l2 fake;
  const auto camera = started(fake);
  const auto second_one = capture::open_v4l2("/dev/video0", {}, fake.system());
  ASSERT_FALSE(second_one);
  EXPECT_TRUE(has(second_one.error(), "another program uses the device"));
  EXPECT_EQ(fake.open_files, 1);
}

/// One camera's life with faults drawn at random; returns the frames it gave.
int random_life(unsigned seed) {
  std::mt19937 random(seed);
  FakeV4l2 fake(random() % 2 == 0);
  fake.controls = {{V4L2_CID_HFLIP, {0, 0, 1}}, {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 1, 10000}}};
  fake.wakes_on_unplugging = random() % 2 == 0;
  fake.random = &random;
  int delivered = 0;
  auto camera = capture::open_v4l2("/dev/video0",
                                   {.request = {.exposure_s = 0.01, .flip_horizontal = true},
                                    .memory = random() % 2 == 0 ? V4l2Memory::mmap : V4l2Memory::dma_buf},
                                   fake.system());
  std::vector<CameraFrame> held;
  for (int step = 0; camera && step < 40; ++step) {
    const std::int64_t before_ms = fake.now_ms;
    switch (random() % 8) {
      case 0:
        static_cast<void>((*camera)->start());
        break;
      case 1:
        if (random() % 4 == 0) (*camera)->stop();
        break;
      case 2:
        if (!held.empty()) (*camera)->return_buffer(held[random() % held.size()]);
        break;
      default:
        fake.frames.push_back(
            {.sequence = static_cast<std::uint32_t>(random()),
             .flags = static_cast<std::uint32_t>(random()),
             .bytes_used = static_cast<std::uint32_t>(random() % 3000),
             .data_offset = static_cast<std::uint32_t>(random() % 4 == 0 ? random() : 0),
             .index = random() % 8 == 0 ? std::optional(static_cast<std::uint32_t>(random() % 6)) : std::nullopt});
        if (const auto frame = (*camera)->next(milliseconds(50))) {
          held.push_back(*frame);
          ++delivered;
        }
    }
    EXPECT_LE(fake.now_ms - before_ms, 60) << seed;  // the time asked for, and one pause
  }
  if (camera) camera->reset();
  EXPECT_EQ(fake.open_files, 0) << seed;
  EXPECT_EQ(fake.open_maps, 0) << seed;
  return delivered;
}

TEST(V4l2Faults, NoScriptOfThemLeaksOrHangs) {
  const unsigned lives = std::getenv("LOWLUX_NIGHTLY") != nullptr ? 200'000 : 3000;
  int delivered = 0;
  for (unsigned seed = 0; seed < lives && !testing::Test::HasFailure(); ++seed) delivered += random_life(seed);
  EXPECT_GT(delivered, static_cast<int>(lives));  // the scripts come as far as frames
}

}  // namespace
}  // namespace lowlux::test
