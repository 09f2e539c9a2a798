#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// What liblowlux_libcamera.so gives. libcamera stands behind this type: its ABI changes with every release, and who
/// has no camera need not load it. Both functions may be called again and from any thread; no exception leaves them.
struct LibcameraModule {
  /// The cameras libcamera finds, in its order; none is no error.
  /// Errors: unreadable (libcamera does not start).
  Result<std::vector<CameraListing>> (*list)() noexcept = nullptr;

  /// Opens the camera that `which` names (find_camera in camera_request.h).
  /// Errors: those of check_camera_request and find_camera; unsupported (it offers no raw stream, or not what was
  /// asked for); unreadable (another program uses it, libcamera refuses); malformed, too_large (agreed_format).
  Result<std::unique_ptr<Camera>> (*open)(const std::string& which, const CameraRequest& request) noexcept = nullptr;
};

/// The module, which is there for as long as the process.
using GetLibcameraModule = const LibcameraModule*() noexcept;

/// The name under which the module holds it; its number counts changes of what stands in this header and in camera.h.
inline constexpr const char* libcamera_module_name = "lowlux_libcamera_1";

extern "C" GetLibcameraModule lowlux_libcamera_1;

}  // namespace lowlux::capture
