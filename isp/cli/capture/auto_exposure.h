#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/result.h"
#include "isp/cli/capture/capture_args.h"
#include "isp/cli/capture/capture_sink.h"
#include "isp/model/sensor/exposure_controller.h"
#include "isp/raw/measure/exposure_meter.h"

namespace lowlux::cli {

/// Summarises automatic exposure for reports.
struct ExposureState {
  double exposure_s = 0;
  std::optional<double> gain;  // a factor; absent if it is not known
  double snr_db = 0;           // predicted, of the mid tone
  isp::ExposureLimit limit = isp::ExposureLimit::motion;
  bool clips = false;  // the highlight clips in the shortest exposure
  int changes = 0;
};

/// Sets a camera's exposure by its frames: `capture --auto-exposure`.
class AutoExposure {
 public:
  /// Takes over the camera's exposure and sets the first one. Errors: those of Camera::take_exposure and of the
  /// profile; no exposure time within the limits, no gain (invalid_argument).
  static Result<std::unique_ptr<AutoExposure>> make(const CaptureArgs& args, capture::Camera& camera);

  /// Meters a frame and sets the exposure of the next ones if it should be another. Completes the facts of a camera
  /// that does not state exposure and gain of its frames. Errors: those of Camera::set_exposure.
  Result<void> take(capture::CameraFrame& frame);

  /// Whether an exposure was found, or was looked for long enough (500 frames).
  bool is_ready() const { return found_ || frames_ >= max_frames; }
  bool found() const { return found_; }
  ExposureState state() const;

 private:
  AutoExposure(capture::Camera& camera, isp::ExposureController::Setup setup, std::vector<capture::CameraGain> gains,
               std::optional<PerSite<double>> black_dn);
  Result<void> set(const isp::ExposureSetting& setting);
  isp::MeteredCodes meter(const capture::CameraFrame& frame);
  isp::MeteredBlack black_of(const capture::FrameFacts& facts);
  std::optional<isp::StatedExposure> stated_by(const capture::FrameFacts& facts) const;

  capture::Camera& camera_;
  std::vector<capture::CameraGain> gains_;     // gains of the controller; empty: the camera's stays
  std::optional<PerSite<double>> black_dn_;    // given
  std::optional<PerSite<double>> darkest_dn_;  // darkest codes of all frames, if black is not known
  double clipped_fraction_;
  isp::ExposureController controller_;
  isp::ExposureMeter meter_;
  std::vector<std::uint16_t> row_;
  static constexpr int max_frames = 500;
  int frames_ = 0;
  bool found_ = false;
};

}  // namespace lowlux::cli
