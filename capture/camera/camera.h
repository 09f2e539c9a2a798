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

/// What is asked of a camera; what is absent is left as the device has it.
struct CameraRequest {
  std::optional<RawFormat> format;  // absent: the deepest raw format offered, Bayer before monochrome
  std::optional<int> width;         // both or none; absent: the largest size
  std::optional<int> height;
  std::optional<double> frame_rate_hz;
  std::optional<double> exposure_s;
  std::optional<double> analogue_gain;
  std::optional<bool> flip_horizontal;
  std::optional<bool> flip_vertical;
  int buffers = 4;  // 2..32
};

/// What was agreed on, as the device gave it back. The phase of a Bayer format is that of the buffer's corner, after
/// the sensor's flips.
struct CameraFormat {
  RawFormat raw;
  int width = 0;
  int height = 0;
  std::size_t stride_bytes = 0;  // from one row to the next; at least row_bytes(raw, width)
  std::optional<double> frame_rate_hz;
};

/// Bytes from the first of a frame to the last of its last row.
inline std::size_t frame_bytes(const CameraFormat& format) {
  return format.stride_bytes * static_cast<std::size_t>(format.height - 1) + row_bytes(format.raw, format.width);
}

/// What the source tells about how one frame was taken; all optional, never guessed.
struct FrameFacts {
  std::optional<double> exposure_s;
  std::optional<double> analogue_gain;                  // factor, 1 is the sensor's least
  std::optional<double> digital_gain;                   // already in the codes or not, as the device has it
  std::optional<std::array<double, 4>> black_level_dn;  // of R, Gr, Gb, B in codes of the stream
  std::optional<std::array<double, 2>> colour_gains;    // of R and B, G's 1
  std::optional<std::array<double, 9>> colour_matrix;   // row-major, white-balanced camera RGB to linear sRGB
  std::optional<double> colour_temperature_k;
  std::optional<double> lux;
  std::optional<double> temperature_c;  // of the sensor
};

/// One frame in the camera's own memory, which may be uncached: read each row once. Borrowed until Camera::give_back.
struct CameraFrame {
  std::span<const std::byte> bytes;       // rows from the first byte on, CameraFormat::stride_bytes apart
  std::uint32_t sequence = 0;             // as the device counts
  std::uint32_t lost_before = 0;          // frames missing between the one delivered last and this one
  std::chrono::nanoseconds timestamp{0};  // CLOCK_MONOTONIC
  bool damaged = false;                   // the device says that this frame is not what the sensor saw
  FrameFacts facts;
  int buffer = 0;  // for Camera::give_back
};

/// A camera that is open and delivers raw frames. One thread at a time.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual const std::string& name() const = 0;  // of the device, for people
  virtual const CameraFormat& format() const = 0;
  virtual const std::vector<std::string>& warnings() const = 0;  // what could not be honoured, one line each
  /// Errors: busy, no space, refused by the driver (unreadable).
  virtual Result<void> start() = 0;
  /// Waits for the next frame. Errors: none came in time (insufficient), the device is gone (not_found), the device
  /// failed (unreadable). After not_found the camera stays dead.
  virtual Result<CameraFrame> next(std::chrono::milliseconds timeout) = 0;
  virtual void give_back(const CameraFrame& frame) = 0;
  /// Ends streaming, at most two seconds; frames that were not given back are void. start() begins anew.
  virtual void stop() = 0;
};

/// One entry of a list of cameras.
struct CameraListing {
  std::string id;                    // what opens it: "/dev/video0", or libcamera's id
  std::string name;                  // for people
  std::vector<std::string> formats;  // raw ones: "SRGGB10_CSI2P 1920x1080 3280x2464"; empty: it offers no raw stream
};

}  // namespace lowlux::capture
