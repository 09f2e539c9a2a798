#pragma once

#include <chrono>
#include <string>

#include "capture/camera/camera.h"
#include "capture/camera/capture_loop.h"
#include "isp/base/result.h"
#include "isp/cli/capture/capture_sink.h"

namespace lowlux::cli {

/// What a run knows of itself.
struct CaptureState {
  CaptureStream stream;
  capture::LoopCount count;
  CaptureWork work;
};

/// "29.9 frames/s, 370 frames, 0 lost, 0 damaged; ms for each: wait 20.1, process 8.0, write 3.2"
std::string progress_text(const CaptureState& state);
/// One JSON object; `error` may be null.
std::string capture_json(const CaptureState& state, const Error* error);

/// Shows progress on stderr once a second, where that is a terminal.
class CaptureProgress {
 public:
  explicit CaptureProgress(bool wanted);
  ~CaptureProgress();
  CaptureProgress(const CaptureProgress&) = delete;
  CaptureProgress& operator=(const CaptureProgress&) = delete;
  void show(const CaptureState& state);
  /// Takes the line away.
  void clear();

 private:
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  bool wanted_;
  bool shown_ = false;
};

}  // namespace lowlux::cli
