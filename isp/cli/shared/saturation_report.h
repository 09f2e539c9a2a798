#pragma once

#include <optional>
#include <string>

#include "isp/raw/measure/saturation_level.h"

namespace lowlux::cli {

/// Returns at which level below white the sensor saturates: text for people, or one JSON object, null where there is no
/// such level.
std::string saturation_text(const isp::SaturationLevel& level);
std::string saturation_json(const std::optional<isp::SaturationLevel>& level);

}  // namespace lowlux::cli
