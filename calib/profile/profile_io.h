#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// The version written. Readers would accept older ones; there are none yet.
inline constexpr int profile_version = 1;

/// The longest text that is accepted [bytes]: a list of 100,000 hot pixels fits.
inline constexpr std::size_t largest_profile_bytes = std::size_t{16} << 20;

/// Returns a profile as JSON, with units in key names. Reading it back gives the same bits. Errors, with the key's
/// path: a value out of range (the limits are those of parse_profile), text that is not UTF-8.
Result<std::string> profile_text(const CameraProfile& profile);

/// Parses a profile from JSON. Every key is required, except those of values that may be unknown, and no others are
/// allowed. Errors, each with the path of the key, as "gains[0].sensor.bits": a key that is missing, unknown or
/// duplicate (the path then without positions in lists); a value of another type; a value out of range; a version that
/// is not known; and text that is not JSON or too long.
Result<CameraProfile> parse_profile(std::string_view text);

}  // namespace lowlux::calib
