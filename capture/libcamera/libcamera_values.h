#pragma once

#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/libcamera/completion_queue.h"
#include "capture/libcamera/libcamera_facts.h"
#include "capture/libcamera/start_controls.h"

namespace libcamera {
class CameraConfiguration;
class ControlInfoMap;
class ControlList;
}  // namespace libcamera

namespace lowlux::capture {

/// A frame's controls as plain values.
LibcameraValues libcamera_values(const libcamera::ControlList& metadata);

/// Which controls a camera has; its ranges are those of the mode it is configured for.
OfferedControls offered_controls(const libcamera::ControlInfoMap& infos);

/// Adds what is to be set.
void add_controls(const StartControls& wanted, libcamera::ControlList& list);

/// Asks for flips, before the configuration is validated. Where only one is given the other is off; none: as it is.
void set_flips(const CameraRequest& request, libcamera::CameraConfiguration& configuration);
/// Whether a validated configuration has the flips asked for.
bool has_flips(const CameraRequest& request, const libcamera::CameraConfiguration& configuration);

/// The state of a buffer by libcamera's FrameMetadata::Status.
CompletionState completion_state(int frame_status);

}  // namespace lowlux::capture
