#pragma once

#include <string_view>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// The profile of a sensor whose figures are quoted from a publication (isp/model/sensor/sensor_db.h): all gain
/// settings that its sources suffice for. Each figure that no source gives is a provenance entry of its own. Errors: an
/// unknown name; a sensor without such a setting.
Result<CameraProfile> quoted_profile(std::string_view sensor);

}  // namespace lowlux::calib
