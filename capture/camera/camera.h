#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Settings requested of a camera; absent settings keep the values of the device.
struct CameraRequest {
  std::optional<RawFormat> format;  // absent: the raw format with most bits, Bayer before monochrome
  std::optional<int> width;         // width and height: both or none; absent: the largest size
  std::optional<int> height;
  std::optional<double> frame_rate_hz;
  std::optional<double> exposure_s;
  std::optional<double> analogue_gain;
  std::optional<bool> flip_horizontal;
  std::optional<bool> flip_vertical;
  int buffers = 4;  // 2..32
};

/// Format agreed on, as the device reported it. The phase of a Bayer format is that of the buffer's corner, after the
/// sensor's flips.
struct CameraFormat {
  RawFormat raw;
  int width = 0;
  int height = 0;
  std::size_t stride_bytes = 0;  // from one row to the next; at least row_bytes(raw, width)
  std::optional<double> frame_rate_hz;
};

/// Returns the bytes from the first of a frame to the last of its last row.
inline std::size_t frame_bytes(const CameraFormat& format) {
  return format.stride_bytes * static_cast<std::size_t>(format.height - 1) + row_bytes(format.raw, format.width);
}

/// Information that the source states about one frame; all optional, never guessed.
struct FrameFacts {
  std::optional<double> exposure_s;
  std::optional<double> analogue_gain;                  // factor, 1 is the sensor's minimum
  std::optional<double> digital_gain;                   // in the codes or not, depending on the device
  std::optional<std::array<double, 4>> black_level_dn;  // levels of R, Gr, Gb, B in codes of the stream
  std::optional<std::array<double, 2>> colour_gains;    // gains of R and B, G's 1
  std::optional<std::array<double, 9>> colour_matrix;   // row-major, white-balanced camera RGB to linear sRGB
  std::optional<double> colour_temperature_k;
  std::optional<double> lux;
  std::optional<double> temperature_c;  // temperature of the sensor
};

/// One frame in the camera's own memory, which may be uncached: read each row once. Borrowed until
/// Camera::return_buffer.
struct CameraFrame {
  std::span<const std::byte> bytes;       // rows from the first byte on, CameraFormat::stride_bytes apart
  std::uint32_t sequence = 0;             // frame number that the device counts
  std::uint32_t lost_before = 0;          // frames missing between the one delivered last and this one
  std::chrono::nanoseconds timestamp{0};  // time by CLOCK_MONOTONIC
  bool damaged = false;                   // the device reports that the data differ from those of the sensor
  FrameFacts facts;
  int buffer = 0;  // index for Camera::return_buffer
};

/// One of the gains that a camera can be set to.
struct CameraGain {
  double factor = 1;  // analogue gain
  int code = 0;       // the driver's value, where it has codes
};

/// Exposure times and gains that an open camera can be set to during streaming.
struct ExposureControls {
  double min_s = 0;  // exposure times: min_s + n step_s up to max_s
  double max_s = 0;
  double step_s = 0;              // 0: every time
  std::vector<CameraGain> gains;  // sorted by factor; empty: the gain cannot be set
};

/// Exposure of the coming frames.
struct CameraExposure {
  double exposure_s = 0;
  std::optional<CameraGain> gain;  // absent: the gain does not change
};

/// An open camera that delivers raw frames. Not thread-safe.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual const std::string& name() const = 0;  // name of the device, for display
  virtual const CameraFormat& format() const = 0;
  virtual const std::vector<std::string>& warnings() const = 0;  // settings that could not be applied, one line each
  /// Starts streaming. Errors: busy, no space, rejected by the driver (unreadable).
  virtual Result<void> start() = 0;
  /// Waits for the next frame. Errors: no frame in time (insufficient), the device was removed (not_found), the device
  /// failed (unreadable). After not_found all later calls fail.
  virtual Result<CameraFrame> next(std::chrono::milliseconds timeout) = 0;
  virtual void return_buffer(const CameraFrame& frame) = 0;
  /// Ends streaming, within two seconds; frames that were not given back become invalid. start() starts it again.
  virtual void stop() = 0;

  /// Switches off the camera's own automatic exposure, and returns the possible settings. Errors: the camera has no
  /// control of its exposure time, or its automatic stays on (unsupported); an unknown gain (invalid_argument).
  virtual Result<ExposureControls> take_exposure() {
    return fail(ErrorCode::unsupported, "the camera has no control of its exposure", name());
  }
  /// Sets the exposure of the coming frames, after take_exposure(); some frames in flight still have the previous one.
  /// @return the exposure time that the device has applied. Errors: the device refuses (unreadable), sets another gain
  /// (unsupported), was removed (not_found).
  virtual Result<double> set_exposure(const CameraExposure& /*exposure*/) {
    return fail(ErrorCode::unsupported, "the camera has no control of its exposure", name());
  }
};

/// One entry of a list of cameras.
struct CameraListing {
  std::string id;                    // argument that opens the camera: "/dev/video0", or libcamera's id
  std::string name;                  // for display
  std::vector<std::string> formats;  // raw formats: "SRGGB10_CSI2P 1920x1080 3280x2464"; empty: no raw stream
};

}  // namespace lowlux::capture
