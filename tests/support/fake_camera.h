#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/camera/camera.h"

namespace lowlux::test {

/// Delivers what a test has written down, as a camera: frames, errors, or nothing for a while.
class FakeCamera final : public capture::Camera {
 public:
  /// Holds what the camera delivers next; nullopt: nothing comes within the time given.
  using Event = std::optional<Result<capture::CameraFrame>>;

  explicit FakeCamera(const capture::CameraFormat& format) : format_(format), memory_(frame_bytes(format)) {}

  capture::CameraFrame frame() const {
    capture::CameraFrame out;
    out.bytes = memory_;
    return out;
  }
  void deliver(const capture::CameraFrame& frame) { events.emplace_back(frame); }

  const std::string& name() const override { return name_; }
  const capture::CameraFormat& format() const override { return format_; }
  const std::vector<std::string>& warnings() const override { return warnings_; }
  Result<void> start() override {
    ++starts;
    return refusal ? Result<void>(tl::make_unexpected(*refusal)) : Result<void>();
  }
  Result<capture::CameraFrame> next(std::chrono::milliseconds timeout) override {
    longest_wait = std::max(longest_wait, timeout);
    if (at_ == events.size() || !events[at_]) {
      if (at_ < events.size()) ++at_;
      std::this_thread::sleep_for(timeout);
      return fail(ErrorCode::insufficient, "no frame came in time from a fake camera", "fake");
    }
    auto event = *events[at_++];
    if (event) event->buffer = lent++;
    return event;
  }
  void return_buffer(const capture::CameraFrame& frame) override {
    last_returned = frame.buffer;
    ++returned;
  }
  void stop() override { ++stops; }

  std::vector<Event> events;
  std::optional<Error> refusal;  // error of start()
  std::chrono::milliseconds longest_wait{0};
  int starts = 0, stops = 0, lent = 0, returned = 0, last_returned = -1;

 private:
  capture::CameraFormat format_;
  std::vector<std::byte> memory_;
  std::size_t at_ = 0;  // index of the next of `events`
  std::string name_ = "fake camera";
  std::vector<std::string> warnings_;
};

}  // namespace lowlux::test
