#pragma once

#include <optional>

#include "isp/base/frame.h"

namespace lowlux::isp {

/// Returns the scene luminance [cd/m2] that just saturates the sensor, from the exposure of the frame:
///     L_saturation = 78 N^2 / (0.65 S t)
/// with N the f-number, S the saturation-based ISO speed, t the exposure time [s]. ISO 12232:2019 defines S_sat = 78 /
/// H with H the focal-plane exposure [lx s] that saturates; H = 0.65 L t / N^2 for a typical lens (ISO 12232, Annex A:
/// q = 0.65). A pixel's luminance is its linear fraction of saturation times this.
/// @return nullopt if one of the three is absent, not finite or not positive
std::optional<double> saturation_luminance_cd_m2(const FrameInfo& info);

}  // namespace lowlux::isp
