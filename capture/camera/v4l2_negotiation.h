#pragma once

#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/camera/v4l2_device.h"
#include "capture/camera/v4l2_layout.h"

namespace lowlux::capture {

struct V4l2Agreement {
  CameraFormat format;
  V4l2Layout layout;                  // as the driver gave it; checked
  std::vector<std::string> warnings;  // what differs from what was to be expected
};

/// Sets format and size. What was asked for is had exactly or is an error that names what the driver offers. A format
/// that was not asked for is the deepest Bayer one, else the deepest monochrome one; a size, the largest listed. Where
/// the driver lists a range of sizes or none, the size in force is kept, and where the media controller has the say
/// also a raw format. The frame rate is left alone.
/// Errors: no such raw format or size (unsupported), a driver that contradicts itself (malformed), more than 2 GiB for
/// all buffers (too_large), and those of the device.
Result<V4l2Agreement> negotiate(V4l2Device& device, const CameraRequest& request);

/// Memory of all buffers of a camera [bytes] at most.
inline constexpr std::size_t most_buffer_bytes = std::size_t{2} << 30;

}  // namespace lowlux::capture
