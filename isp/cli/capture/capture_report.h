#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "capture/camera/camera.h"
#include "capture/camera/capture_loop.h"
#include "isp/base/result.h"
#include "isp/cli/capture/auto_exposure.h"
#include "isp/cli/capture/capture_sink.h"

namespace lowlux::cli {

/// Holds the state of a run for reports.
struct CaptureState {
  CaptureStream stream;
  capture::LoopCount count;
  CaptureWork work;
  std::optional<ExposureState> exposure;  // absent: not automatic
};

/// Returns "29.9 frames/s, 370 frames, 0 lost, 0 damaged; ms for each: wait 20.1, process 8.0, write 3.2", with the
/// exposure if it is automatic.
std::string progress_text(const CaptureState& state);
/// Returns one JSON object; `error` may be null.
std::string capture_json(const CaptureState& state, const Error* error);

/// Shows progress on stderr once a second, where that is a terminal.
class CaptureProgress {
 public:
  explicit CaptureProgress(bool wanted);
  ~CaptureProgress();
  CaptureProgress(const CaptureProgress&) = delete;
  CaptureProgress& operator=(const CaptureProgress&) = delete;
  void show(const CaptureState& state);
  /// Removes the line.
  void clear();

 private:
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  bool wanted_;
  bool shown_ = false;
};

}  // namespace lowlux::cli
