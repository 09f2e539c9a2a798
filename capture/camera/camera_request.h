#pragma once

#include <span>
#include <string>
#include <string_view>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Checks a request independently of the camera: 2 to 32 buffers; width and height both or none, 1 to 65535;
/// frame rate, exposure and gain finite and above 0.
/// Errors: invalid_argument.
Result<void> check_camera_request(const CameraRequest& request);

/// Finds the camera of a list that `wanted` names: by its id; else by its index in the list, from 0; else by text that
/// is in the id or name of only one of them. Empty text means the only camera. @return its index in the list
/// Errors: not_found (none matches, or there is no camera), invalid_argument (several match); both list the cameras.
Result<int> find_camera(std::span<const CameraListing> cameras, std::string_view wanted);

}  // namespace lowlux::capture
