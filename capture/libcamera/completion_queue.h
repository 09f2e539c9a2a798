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

/// State of a buffer returned by a camera.
enum class CompletionState : std::uint8_t {
  filled,
  startup,   // filled while the camera settles: not to be used
  damaged,   // filled with data other than the sensor's
  cancelled  // not filled: the stream ends
};

/// Describes a completed request of libcamera.
struct Completion {
  int buffer = 0;
  CompletionState state = CompletionState::filled;
  std::uint32_t sequence = 0;
  std::chrono::nanoseconds timestamp{0};
  std::size_t bytes_used = 0;
  FrameFacts facts;
};

/// Queue of buffers from a camera's own thread to the consumer of frames. All functions may be called from both
/// threads.
class CompletionQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Reserves one completion for each buffer; nothing is allocated later.
  explicit CompletionQueue(int buffers);

  /// Adds a completion, on the camera's thread. It is dropped if the queue is full: no buffer comes back twice.
  void push(const Completion& completion) noexcept;
  /// Records, on the camera's thread, that the camera was unplugged, permanently.
  void set_disconnected() noexcept;
  bool is_disconnected() const;

  /// Returns the oldest completion; waits for one until the deadline. nullopt: none came, or the camera is gone and
  /// left none.
  std::optional<Completion> take(Time deadline);
  /// Returns whether the camera is gone; waits for it until the deadline.
  bool wait_disconnected(Time deadline);
  void clear();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Completion> completions_;
  bool gone_ = false;
};

}  // namespace lowlux::capture
