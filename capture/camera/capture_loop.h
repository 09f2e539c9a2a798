#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// How many frames are taken of a camera. Damaged ones do not count.
struct LoopLimits {
  std::uint64_t frames = 1;                 // 0: until stopped
  std::uint64_t skip = 0;                   // that come first and are left out: exposure settles
  std::chrono::milliseconds timeout{5000};  // for each whole frame to come
};

struct LoopCount {
  std::uint64_t taken = 0;
  std::uint64_t skipped = 0;
  std::uint64_t lost = 0;     // missing, as the device counts
  std::uint64_t damaged = 0;  // left out
  double seconds = 0;         // from the first frame's arrival on
  double wait_s = 0;          // of these, waiting for frames
  bool stopped = false;       // by `stop`
};

/// What a frame is taken for. false: no more are wanted.
using FrameWork = std::function<Result<bool>(const CameraFrame& frame)>;
/// Told after each frame and each tenth of a second without one.
using LoopWatch = std::function<void(const LoopCount& count)>;

/// Starts a camera, does `work` with each of its whole frames, gives all back and stops the camera, whatever comes.
/// `stop` is looked at after each frame and each tenth of a second; a frame being worked on is finished.
/// @param count  holds what was done, after an error too
/// Errors: those of the camera, which ends with its first; no whole frame within the limit (insufficient); those of
/// `work`.
Result<void> capture_frames(Camera& camera, const LoopLimits& limits, const std::atomic<bool>& stop,
                            const FrameWork& work, const LoopWatch& watch, LoopCount& count);

}  // namespace lowlux::capture
