#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Functions of liblowlux_libcamera.so. libcamera is loaded through this type: its ABI changes with every release, and
/// it is not needed without a camera. Both functions may be called again and from any thread; no exception leaves them.
struct LibcameraModule {
  /// Lists the cameras that libcamera finds, in its order; an empty list is not an error.
  /// Errors: unreadable (libcamera does not start).
  Result<std::vector<CameraListing>> (*list)() noexcept = nullptr;

  /// Opens the camera that `which` names (find_camera in camera_request.h).
  /// Errors: those of check_camera_request and find_camera; unsupported (it offers no raw stream, or not the requested
  /// one); unreadable (another program uses it, libcamera rejects it); malformed, too_large (agreed_format).
  Result<std::unique_ptr<Camera>> (*open)(const std::string& which, const CameraRequest& request) noexcept = nullptr;
};

/// Returns the module, which exists for the lifetime of the process.
using GetLibcameraModule = const LibcameraModule*() noexcept;

/// Name of the function in the module; its number counts changes of this header and of camera.h.
inline constexpr const char* libcamera_module_name = "lowlux_libcamera_1";

extern "C" GetLibcameraModule lowlux_libcamera_1;

}  // namespace lowlux::capture
