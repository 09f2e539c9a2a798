#pragma once

#include <string>

#include "isp/base/camera_profile.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"
#include "isp/pipeline/options.h"

namespace lowlux::cli {

/// What is used of a camera's profile.
struct ProfileChoice {
  bool everything = false;   // its colour matrices too
  std::string gain_setting;  // as calib::gain_named has it; empty: by the frame's ISO
};

/// Puts what a camera's profile says of a frame into the frame, in place of what its file says: noise, hot pixels to be
/// repaired, warnings, and with `everything` the profile's matrices if it holds any. The black point goes into the
/// options unless they ask for another, and the ISO speed of the setting for looks that need the luminance of the
/// scene. Errors: those of calib::profile_at; without `everything` a profile that knows no black level.
Result<void> use_profile(const CameraProfile& profile, const ProfileChoice& choice, RawFrame& frame,
                         isp::DevelopOptions& options);

/// The profile in a JSON file. Errors: the file cannot be read; those of calib::parse_profile, with the key's path.
Result<CameraProfile> read_profile(const std::string& path);

/// A profile as a JSON file, whole or not at all. Errors: those of calib::profile_text and isp::AtomicFile.
Result<void> write_profile(const std::string& path, const CameraProfile& profile, isp::Overwrite overwrite);

}  // namespace lowlux::cli
