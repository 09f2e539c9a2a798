#pragma once

#include "isp/base/matrix3.h"
#include "isp/render/hue_sat_map.h"

namespace lowlux::reference {

/// Passes one colour in linear ProPhoto RGB through a HueSatMap, in double.
Vector3 through_hue_sat_map(const isp::HueSatMap& map, const Vector3& rgb);

}  // namespace lowlux::reference
