#pragma once

#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/cli/noise/noise_origin.h"

namespace lowlux::cli {

/// Returns the files in which darktable may have installed its table of noise, in the order in which they are tried:
/// darktable/noiseprofiles.json in the folders of XDG_DATA_DIRS (/usr/local/share and /usr/share where it is not set),
/// then those of /opt/darktable and of Flatpak.
std::vector<std::string> darktable_files();

/// Returns what is known of the noise of a frame's sensor without measuring it: darktable's figures of the camera, else
/// those of libcamera for a sensor of Raspberry Pi, else those of the class of the sensor. The first two need an ISO.
/// A table of darktable's that cannot be read adds a warning, and is not used.
/// @param range_dn  white less black, above 0
NoiseOrigin known_noise(const RawDn& raw, double range_dn, std::vector<std::string>& warnings);

}  // namespace lowlux::cli
