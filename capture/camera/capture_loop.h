#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Limits on the frames taken from a camera. Damaged frames do not count.
struct LoopLimits {
  std::uint64_t frames = 1;                 // 0: until stopped
  std::uint64_t skip = 0;                   // number of first frames left out, while exposure settles
  std::chrono::milliseconds timeout{5000};  // for each undamaged frame
};

/// Counts the frames of a capture.
struct LoopCount {
  std::uint64_t taken = 0;
  std::uint64_t skipped = 0;
  std::uint64_t lost = 0;     // missing, by the device's count
  std::uint64_t damaged = 0;  // left out
  double seconds = 0;         // since the first frame's arrival
  double wait_s = 0;          // part of `seconds` spent waiting for frames
  bool stopped = false;       // by `stop`
};

/// Processes a frame. Returns false if no more frames are wanted.
using FrameWork = std::function<Result<bool>(const CameraFrame& frame)>;
/// Looks at a frame, and may complete its facts. Returns false if it is to be left out.
using FrameCheck = std::function<Result<bool>(CameraFrame& frame)>;
/// Called after each frame and each tenth of a second without one.
using LoopWatch = std::function<void(const LoopCount& count)>;

/// Starts a camera, calls `work` with each of its undamaged frames, gives all back and stops the camera in every case.
/// `stop` is read after each frame and each tenth of a second; a frame being processed is finished.
/// @param count  holds the counts, after an error too
/// @param check  called with each undamaged frame before `work`; frames that it leaves out count as skipped
/// Errors: those of the camera, whose first one ends the loop; no undamaged frame within the limit (insufficient);
/// those of `work`.
Result<void> capture_frames(Camera& camera, const LoopLimits& limits, const std::atomic<bool>& stop,
                            const FrameWork& work, const LoopWatch& watch, LoopCount& count,
                            const FrameCheck& check = {});

}  // namespace lowlux::capture
