#pragma once

#include <string>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::cli {

/// The profile in a JSON file. Errors: the file cannot be read; those of calib::parse_profile, with the key's path.
Result<CameraProfile> read_profile(const std::string& path);

/// A profile as a JSON file, whole or not at all. Errors: those of calib::profile_text and isp::AtomicFile.
Result<void> write_profile(const std::string& path, const CameraProfile& profile, isp::Overwrite overwrite);

}  // namespace lowlux::cli
