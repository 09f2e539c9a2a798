#pragma once

#include <string>

#include "calib/profile/profile_use.h"
#include "isp/base/camera_profile.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"
#include "isp/pipeline/options.h"

namespace lowlux::cli {

/// Selects the parts of a camera's profile that are used.
struct ProfileChoice {
  bool everything = false;   // includes its colour matrices
  bool with_darks = false;   // dark frames are going to give the level: the noise, from which they are made, is that of
                             // the profile, the same for all images
  std::string gain_setting;  // name for calib::gain_named; empty: by the frame's ISO
};

/// Replaces values of a frame's file with those of a camera's profile: noise, hot pixels to be repaired, warnings, and
/// with `everything` the profile's matrices if it holds any. The black point is put into the options: with
/// `everything` masked pixels of the frame itself come first, without it the profile's is used unless the options
/// request another; a pedestal that these state, of the file or given, has the profile's dark charge added. The noise
/// is that above this black point. So are the ISO speed of the setting and the camera, for looks that need the
/// luminance and the light of the scene. Errors: those of calib::profile_at; without `everything` a profile without a
/// black level.
/// @return what the profile states at the setting of the frame, for calib::noise_above another black point
Result<calib::ProfileAtFrame> use_profile(const CameraProfile& profile, const ProfileChoice& choice, RawFrame& frame,
                                          isp::DevelopOptions& options);

/// Reads a profile from a JSON file. Errors: the file is unreadable; those of calib::parse_profile, with the key's
/// path.
Result<CameraProfile> read_profile(const std::string& path);

/// Writes a profile as a JSON file, completely or not at all. Errors: those of calib::profile_text and isp::AtomicFile.
Result<void> write_profile(const std::string& path, const CameraProfile& profile, isp::Overwrite overwrite);

}  // namespace lowlux::cli
