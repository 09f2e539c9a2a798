#pragma once

#include "capture/camera/libcamera_module.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// libcamera's cameras, loaded from liblowlux_libcamera.so; see module.h. Only who opens a camera pays for libcamera
/// (capture/camera/libcamera_module.h).
/// Errors: unreadable, as load_module(); so too where lowlux was built without libcamera.
Result<capture::LibcameraModule> load_libcamera();

}  // namespace lowlux::cli
