#pragma once

#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/camera/v4l2_device.h"
#include "capture/camera/v4l2_source.h"

namespace lowlux::capture {

/// Asks for the frame rate (VIDIOC_S_PARM) and notes in `format` what the driver made of it, or has. What was not had
/// goes to `warnings`.
void apply_frame_rate(V4l2Device& device, const CameraRequest& request, CameraFormat& format,
                      std::vector<std::string>& warnings);

/// Sets exposure time and gain where they are asked for, their automatics switched off first. What was not had goes to
/// `warnings`; a gain code outside of the control's range is an error (invalid_argument).
Result<void> apply_exposure(V4l2Device& device, const V4l2Options& options, const CameraFormat& format,
                            std::vector<std::string>& warnings);

/// What the controls tell about the frames to come. The exposure time only if no automatic changes it and its unit is
/// known: V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us, V4L2_CID_EXPOSURE lines, whose time follows from the pixel rate and
/// the horizontal blanking if the node has both. The gain only at its least, which is the factor 1: V4L2 does not say
/// what its codes stand for. The black level of V4L2_CID_BLACK_LEVEL, in codes of the stream, if it is one.
FrameFacts read_facts(V4l2Device& device, const CameraFormat& format);

}  // namespace lowlux::capture
