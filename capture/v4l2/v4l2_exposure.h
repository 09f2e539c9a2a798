#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_device.h"

namespace lowlux::capture {

/// Requests the frame rate (VIDIOC_S_PARM) and stores in `format` the rate that the driver set, or has. Deviations are
/// added to `warnings`.
void apply_frame_rate(V4l2Device& device, const CameraRequest& request, CameraFormat& format,
                      std::vector<std::string>& warnings);

/// Sets exposure time and gain if requested, after switching off their automatics. Deviations are added to `warnings`;
/// a gain code outside the control's range is an error (invalid_argument).
Result<void> apply_exposure(V4l2Device& device, const V4l2Options& options, const CameraFormat& format,
                            std::vector<std::string>& warnings);

/// Returns what the controls state about the coming frames. The exposure time only if no automatic changes it and its
/// unit is known: V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us, V4L2_CID_EXPOSURE lines, whose time follows from the pixel
/// rate and the horizontal blanking if the node has both. The gain only at its minimum, which is the factor 1: V4L2
/// does not define what its codes mean. The black level of V4L2_CID_BLACK_LEVEL, in codes of the stream, if it is a
/// black level.
FrameFacts read_facts(V4l2Device& device, const CameraFormat& format);

/// A control that the node has and that is not disabled. Its values are in its own units.
struct V4l2Control {
  std::uint32_t id = 0;
  int minimum = 0;
  int maximum = 0;
  int step = 1;  // at least 1
  bool writable = false;
  bool is_steady = false;        // active, and its value is not changed by the hardware
  bool modifies_layout = false;  // setting it may change the format
};
/// The control of the exposure time, with the unit of its steps.
struct V4l2ExposureTime {
  V4l2Control control;
  double unit_s = 0;
  /// V4L2_CID_VBLANK, if the exposure counts lines and the driver lets it be set: a frame holds no longer exposure than
  /// its lines, and vertical blanking adds lines to it.
  std::optional<V4l2Control> blanking;
  int blanking_lines = 0;  // when `control` was read

  /// Returns the longest exposure time, with the most blanking [s].
  double max_s() const;
};
/// Returns V4L2_CID_EXPOSURE_ABSOLUTE, else V4L2_CID_EXPOSURE if the time of a line is known.
std::optional<V4l2ExposureTime> find_exposure_time(V4l2Device& device, const CameraFormat& format);
/// Sets the exposure time that is nearest to `wanted_s` and returns the one that the driver set [s]. Adds as much
/// vertical blanking as the exposure needs, so that frames come more slowly, and takes it back for shorter exposures.
/// An error states why the driver refuses.
Result<double> set_exposure_time(V4l2Device& device, const V4l2ExposureTime& time, double wanted_s);
/// Ends automatic exposure, or sets the mode in which only the iris is automatic. Returns whether the time stays as
/// set.
bool end_automatic_exposure(V4l2Device& device);
/// Returns V4L2_CID_ANALOGUE_GAIN, else V4L2_CID_GAIN.
std::optional<V4l2Control> find_gain(V4l2Device& device);
/// Switches automatic gain off. Returns whether the gain stays as set.
bool end_automatic_gain(V4l2Device& device);
/// Returns "0 to 232".
std::string range_text(const V4l2Control& control);

std::optional<V4l2Control> find_control(V4l2Device& device, std::uint32_t id);
/// Returns the control's value; nullopt if it cannot be read.
std::optional<int> read_control(V4l2Device& device, std::uint32_t id);
/// Returns a value of 64 bits, such as the pixel rate.
std::optional<std::int64_t> read_wide_control(V4l2Device& device, std::uint32_t id);
/// Sets the value nearest to `wanted` within the control's range and step, and reads it back; an error states the
/// reason of a failure.
Result<int> write_control(V4l2Device& device, const V4l2Control& control, double wanted);

/// Sets the requested flips. They must be set before the format is negotiated: flips change the order of the mosaic,
/// and the driver reports this by another format. Deviations are added to `warnings`. Returns the flips that are on and
/// for which the driver does not state that they change the layout: "horizontal flip", ...
std::vector<std::string> apply_flips(V4l2Device& device, const CameraRequest& request,
                                     std::vector<std::string>& warnings);

}  // namespace lowlux::capture
