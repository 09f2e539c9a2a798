#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_device.h"

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

/// A control that the node has and that is not disabled. Its figures are in its own units.
struct V4l2Control {
  std::uint32_t id = 0;
  int minimum = 0;
  int maximum = 0;
  int step = 1;  // at least 1
  bool writable = false;
  bool is_steady = false;        // active, and no value that the hardware changes by itself
  bool modifies_layout = false;  // setting it may change the format
};
std::optional<V4l2Control> find_control(V4l2Device& device, std::uint32_t id);
/// Its value; nullopt if there is none to be had.
std::optional<int> read_control(V4l2Device& device, std::uint32_t id);
/// A value of 64 bits, such as the pixel rate.
std::optional<std::int64_t> read_wide_control(V4l2Device& device, std::uint32_t id);
/// Sets the value next to `wanted` that the control's range and step hold, and reads it back; the reason where that
/// failed.
Result<int> write_control(V4l2Device& device, const V4l2Control& control, double wanted);

/// Sets the flips that are asked for. To be done before the format is negotiated: flips change the order of the mosaic,
/// and the driver says so by another format. What was not had goes to `warnings`. Returns the flips that are on and of
/// which the driver does not say that they change the layout: "horizontal flip", ...
std::vector<std::string> apply_flips(V4l2Device& device, const CameraRequest& request,
                                     std::vector<std::string>& warnings);

}  // namespace lowlux::capture
