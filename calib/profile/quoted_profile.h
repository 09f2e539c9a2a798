#pragma once

#include <string_view>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Returns the profile of a sensor with figures quoted from a publication (isp/model/sensor/sensor_db.h): all gain
/// settings with sufficient sources. Each figure without a source has a provenance entry of its own. Errors: an unknown
/// name; a sensor without such a setting.
Result<CameraProfile> quoted_profile(std::string_view sensor);

}  // namespace lowlux::calib
