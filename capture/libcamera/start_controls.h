#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// A range that a camera states for one of its controls.
struct ControlRange {
  double least = 0;
  double largest = 0;
};

/// One of libcamera's controls: whether the camera has it, and its range where that is stated.
struct OfferedControl {
  bool offered = false;
  std::optional<ControlRange> range;
};

/// The controls that lowlux sets.
struct OfferedControls {
  bool ae_enable = false;
  OfferedControl exposure_us;        // ExposureTime
  OfferedControl analogue_gain;      // AnalogueGain
  OfferedControl frame_duration_us;  // FrameDurationLimits
};

/// Values to be set at the start of a stream; absent: not set.
struct StartControls {
  bool ae_off = false;  // AeEnable = false
  std::optional<std::int32_t> exposure_us;
  std::optional<float> analogue_gain;
  std::optional<std::array<std::int64_t, 2>> frame_duration_us;  // shortest, longest
  std::vector<std::string> warnings;                             // settings that cannot be applied, one line each
};

/// Returns the controls to set for a request that passed check_camera_request. A control that the camera does not have
/// is left out with a warning. A value beyond the stated range is set nevertheless, with a warning: cameras state
/// ranges of another mode until they run, and they use the nearest value. Automatic exposure is switched off if
/// exposure or gain is given. Pipelines limit frames to 1/30 s, or to less than a given exposure, by default (Raspberry
/// Pi's defaultMinFrameDuration and defaultMaxFrameDuration), so an exposure above 1/30 s without a frame rate requests
/// frames long enough for it.
StartControls start_controls(const CameraRequest& request, const OfferedControls& offered);

/// Returns what automatic exposure can set: times of the stated range, gains of the stated range in steps of a
/// sixteenth of 1 EV, from the lowest on; none if the request states one. Errors: no control of the exposure time, or
/// none with a range (unsupported).
Result<ExposureControls> exposure_controls(const CameraRequest& request, const OfferedControls& offered);

/// Returns the controls for an exposure within exposure_controls(). Frames last as long as the request's rate states,
/// else 1/30 s, or longer if the exposure is.
StartControls exposure_settings(const CameraRequest& request, const CameraExposure& exposure,
                                const OfferedControls& offered);

}  // namespace lowlux::capture
