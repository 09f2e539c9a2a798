#pragma once

#include <optional>
#include <string>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// A gain setting's figures at an ISO, and what to tell of how they came about.
struct GainAtIso {
  GainProfile gain;
  std::string warning;  // empty if none
};

/// @param iso  of the frame; none if it states none
/// @param profile  has gain settings
/// Errors: see profile_at.
Result<GainAtIso> gain_at_iso(const CameraProfile& profile, const std::optional<double>& iso);

/// @param name  of a setting, as the profile has it ("gain 120"), or an ISO ("ISO 1600", "1600"), measured or not
/// Errors: the profile has no such setting; see profile_at.
Result<GainAtIso> gain_named(const CameraProfile& profile, const std::string& name);

}  // namespace lowlux::calib
