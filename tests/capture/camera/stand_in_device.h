#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "capture/libcamera/request_camera.h"

namespace lowlux::capture {

inline constexpr int buffer_count = 3;
inline constexpr std::size_t stride_bytes = 16, needed_bytes = 16 * 3 + 12;

/// What the stand-in camera was asked, and what it shall answer. Shared, since the device dies with its camera.
struct Script {
  std::shared_ptr<CompletionQueue> completions = std::make_shared<CompletionQueue>(buffer_count);
  int start_result = 0;
  int queue_result = 0;
  bool readable = true;
  int starts = 0;
  int stops = 0;
  int readings = 0;  // begun and not ended
  bool alive = true;
  Result<ExposureControls> exposure_controls = fail(ErrorCode::unsupported, "no control");
  std::vector<CameraExposure> exposures;  // that were set
  std::deque<int> queued;
  std::array<std::array<std::byte, 64>, buffer_count> memory{};

  /// Completes the buffer queued first.
  void complete(std::uint32_t sequence, CompletionState state = CompletionState::filled,
                std::size_t bytes_used = needed_bytes) {
    ASSERT_FALSE(queued.empty());
    completions->push({.buffer = queued.front(),
                       .state = state,
                       .sequence = sequence,
                       .timestamp = std::chrono::milliseconds(10 * sequence + 1),
                       .bytes_used = bytes_used,
                       .facts = {.exposure_s = 0.5}});
    queued.pop_front();
  }
};

class StandIn final : public RequestDevice {
 public:
  explicit StandIn(Script& script) : script_(script) {}
  ~StandIn() override { script_.alive = false; }
  int start() override {
    ++script_.starts;
    return script_.start_result;
  }
  void stop() override {
    ++script_.stops;
    while (!script_.queued.empty()) script_.complete(0, CompletionState::cancelled);
  }
  int queue(int buffer) override {
    if (script_.queue_result == 0) script_.queued.push_back(buffer);
    return script_.queue_result;
  }
  std::span<const std::byte> bytes(int buffer) const override {
    return script_.memory[static_cast<std::size_t>(buffer)];
  }
  bool begin_reading(int /*buffer*/) override {
    ++script_.readings;
    return script_.readable;
  }
  void end_reading(int /*buffer*/) override { --script_.readings; }
  Result<ExposureControls> take_exposure() override { return script_.exposure_controls; }
  void set_exposure(const CameraExposure& exposure) override { script_.exposures.push_back(exposure); }

 private:
  Script& script_;
};

}  // namespace lowlux::capture
