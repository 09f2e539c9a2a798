#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"

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

/// Values for the start of a stream; absent: not set.
struct StartControls {
  bool ae_off = false;  // AeEnable = false
  std::optional<std::int32_t> exposure_us;
  std::optional<float> analogue_gain;
  std::optional<std::array<std::int64_t, 2>> frame_duration_us;  // shortest, longest
  std::vector<std::string> warnings;                             // what cannot be honoured, one line each
};

/// What to set for a request that passed check_camera_request. A control the camera does not have is left out with a
/// warning. One beyond the stated range is set all the same, with a warning: cameras state ranges of another mode until
/// they run, and they take the nearest value. Automatic exposure is off as soon as exposure or gain is given.
/// Pipelines hold frames to 1/30 s or less than a given exposure unless told (Raspberry Pi's defaultMinFrameDuration
/// and defaultMaxFrameDuration), so an exposure above 1/30 s without a frame rate asks for frames that hold it.
StartControls start_controls(const CameraRequest& request, const OfferedControls& offered);

}  // namespace lowlux::capture
