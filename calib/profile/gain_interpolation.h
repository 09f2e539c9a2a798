#pragma once

#include <optional>
#include <string>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Properties of a gain setting at an ISO, with a warning about their origin.
struct GainAtIso {
  GainProfile gain;
  std::string warning;  // empty if none
};

/// Interpolates a profile's gain settings at an ISO.
/// @param iso  ISO of the frame; absent if it states none
/// @param profile  has gain settings
/// Errors: see profile_at.
Result<GainAtIso> gain_at_iso(const CameraProfile& profile, const std::optional<double>& iso);

/// ISO speed of an analogue gain of 1.
inline constexpr double unit_iso = 100;

/// Returns the ISO of the profile's only gain setting, which also holds for frames that state no ISO; absent if the
/// profile has several settings, none, or states no ISO.
std::optional<double> only_iso(const CameraProfile& profile);

/// Returns the properties of a named gain setting.
/// @param name  name of a setting, as in the profile ("gain 120"), or an ISO ("ISO 1600", "1600"), measured or not
/// Errors: the profile has no such setting; see profile_at.
Result<GainAtIso> gain_named(const CameraProfile& profile, const std::string& name);

}  // namespace lowlux::calib
