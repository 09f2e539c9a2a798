#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// The version written. Older ones would be read; there are none yet.
inline constexpr int profile_version = 1;

/// The longest text that is read [bytes]: a list of 100,000 hot pixels fits.
inline constexpr std::size_t largest_profile_bytes = std::size_t{16} << 20;

/// A profile as JSON, units in key names. Reading it back gives the same bits.
/// Errors, with the key's path: a figure that cannot be (the limits are those of parse_profile), text that is not
/// UTF-8.
Result<std::string> profile_text(const CameraProfile& profile);

/// A profile from JSON. Every key must be there, those of figures that may be unknown excepted, and none besides.
/// Errors, each one with the path of the key, as "gains[0].sensor.bits": a key that is missing, unknown or there twice
/// (the path then without positions in lists);
/// a value of another type; a value that cannot be; a version that is not known; and text that is no JSON or too long.
Result<CameraProfile> parse_profile(std::string_view text);

}  // namespace lowlux::calib
