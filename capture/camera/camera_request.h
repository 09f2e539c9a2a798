#pragma once

#include <span>
#include <string>
#include <string_view>

#include "capture/camera/camera.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Whether a request makes sense whatever the camera: 2 to 32 buffers; width and height both or none, 1 to 65535;
/// frame rate, exposure and gain finite and above 0.
/// Errors: invalid_argument.
Result<void> check_camera_request(const CameraRequest& request);

/// The camera of a list that `wanted` names: its id; else its place in the list, from 0; else text that only one of
/// them has in its id or name. Empty text means the only camera there is. @return its place in the list Errors:
/// not_found (none fits, or there is no camera), invalid_argument (several do); both name what there is.
Result<int> find_camera(std::span<const CameraListing> cameras, std::string_view wanted);

}  // namespace lowlux::capture
