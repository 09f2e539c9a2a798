#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Holds the size of a frame in pixels.
struct FrameSize {
  int width = 0;
  int height = 0;
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

/// One pixel format that a libcamera stream offers, raw or not, with its sizes (empty if it does not list them).
struct OfferedStream {
  std::uint32_t drm_fourcc = 0;
  std::uint64_t drm_modifier = 0;
  std::vector<FrameSize> sizes;
};

/// Format requested of libcamera. A size of 0 x 0 leaves it to the camera.
struct RawStreamChoice {
  RawFormat format;
  std::uint32_t drm_fourcc = 0;
  std::uint64_t drm_modifier = 0;
  FrameSize size;
};

/// Returns the raw formats among those offered: "SRGGB10_CSI2P 1920x1080 3280x2464".
std::vector<std::string> raw_stream_texts(std::span<const OfferedStream> offered);

/// Chooses among the formats of a camera, for a request that passed check_camera_request: the requested format, else
/// one that lists the requested size, else any; Bayer before monochrome, then the deepest, then the one with the
/// largest size, then the first. The size is the requested one, else the largest.
/// Errors: unsupported (no raw stream at all: processed images are never used as raw; or not in that format).
Result<RawStreamChoice> choose_raw_stream(std::span<const OfferedStream> offered, const CameraRequest& request,
                                          const std::string& camera);

/// Response of libcamera to a choice.
struct AgreedStream {
  std::uint32_t drm_fourcc = 0;
  std::uint64_t drm_modifier = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t stride_bytes = 0;
  std::uint32_t frame_bytes = 0;  // bytes of one buffer
  std::uint32_t buffers = 0;
};

/// Returns the format agreed on. `warnings` are appended to: a format or size that was not requested and differs from
/// the choice; a Bayer phase other than the requested one, which depends on the sensor's flips.
/// Errors: unsupported (not the requested format or size, no raw format), malformed (strides and sizes that contradict
/// each other), too_large (buffers above 4 GiB together).
Result<CameraFormat> agreed_format(const AgreedStream& agreed, const RawStreamChoice& choice,
                                   const CameraRequest& request, std::vector<std::string>& warnings);

}  // namespace lowlux::capture
