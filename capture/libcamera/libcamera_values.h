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

/// Returns a frame's controls as plain values.
LibcameraValues libcamera_values(const libcamera::ControlList& metadata);

/// Returns the controls of a camera; its ranges are those of the mode it is configured for.
OfferedControls offered_controls(const libcamera::ControlInfoMap& infos);

/// Adds the controls to be set.
void add_controls(const StartControls& wanted, libcamera::ControlList& list);

/// Requests flips, before the configuration is validated. If only one is given the other is off; if none, they are
/// unchanged.
void set_flips(const CameraRequest& request, libcamera::CameraConfiguration& configuration);
/// Returns whether a validated configuration has the requested flips.
bool has_flips(const CameraRequest& request, const libcamera::CameraConfiguration& configuration);

/// Returns the state of a buffer by libcamera's FrameMetadata::Status.
CompletionState completion_state(int frame_status);

}  // namespace lowlux::capture
