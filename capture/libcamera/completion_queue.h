#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "capture/camera/camera.h"

namespace lowlux::capture {

/// How a buffer came back from a camera.
enum class CompletionState : std::uint8_t {
  filled,
  startup,   // filled while the camera settles: not for use
  damaged,   // filled with something else than what the sensor saw
  cancelled  // not filled: the stream ends
};

struct Completion {
  int buffer = 0;
  CompletionState state = CompletionState::filled;
  std::uint32_t sequence = 0;
  std::chrono::nanoseconds timestamp{0};
  std::size_t bytes_used = 0;
  FrameFacts facts;
};

/// Buffers on their way from a camera's own thread to the one that wants frames. All functions may be called from both.
class CompletionQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Room for one completion of each buffer; nothing is allocated later.
  explicit CompletionQueue(int buffers);

  /// From the camera's thread. What is beyond the room is dropped: no buffer comes back twice.
  void push(const Completion& completion) noexcept;
  /// From the camera's thread: it was unplugged, for good.
  void set_gone() noexcept;
  bool is_gone() const;

  /// The oldest completion; waits until the deadline for one. nullopt: none came, or the camera is gone and left none.
  std::optional<Completion> take(Time deadline);
  /// Whether the camera is gone; waits until the deadline for it.
  bool wait_gone(Time deadline);
  void clear();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Completion> completions_;
  bool gone_ = false;
};

}  // namespace lowlux::capture
