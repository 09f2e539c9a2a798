#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_device.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Opens a V4L2 camera ("/dev/video0") and agrees with it on a format; memory is allocated by Camera::start. A
/// requested format or size is set or is an error; other requested settings that could not be applied are
/// Camera::warnings.
/// Errors: no such device (not_found), another program uses it, or it may not be opened (unreadable), it captures no
/// raw data or not in the requested format (unsupported), its driver contradicts itself (malformed), more than 2 GiB
/// for all buffers (too_large), a request outside its range (invalid_argument). Camera::start also fails if the media
/// controller's links do not fit (unreadable), or with too little memory (too_large).
Result<std::unique_ptr<Camera>> open_v4l2(const std::string& device, const V4l2Options& options,
                                          const V4l2System& system = v4l2_system());

/// Lists all nodes that capture video, in the order of their numbers. One that may not be opened or is busy is listed
/// with the reason as its name and without formats.
std::vector<CameraListing> list_v4l2_cameras(const V4l2System& system = v4l2_system());

}  // namespace lowlux::capture
