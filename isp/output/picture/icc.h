#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "isp/base/image.h"
#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// An ICC v4 matrix profile of the space, the same bytes every time: no creation date, and a profile ID.
/// Empty for xyz and camera, whose numbers no RGB profile describes.
std::vector<std::byte> icc_profile(OutputSpace space);

/// Primaries and white. XYZ counts as the RGB space whose primaries are the axes of XYZ (what OpenEXR readers expect of
/// it), its white the equal-energy point; nullopt for camera, whose primaries are not known.
std::optional<Chromaticities> chromaticities_of(OutputSpace space);

}  // namespace lowlux::isp
