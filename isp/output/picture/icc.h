#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "isp/base/image.h"
#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Returns an ICC v4 matrix profile of the space, the same bytes every time: no creation date, and a profile ID. That
/// of xyz has the axes of XYZ as its colorants. Empty for camera, which no RGB profile describes.
std::vector<std::byte> icc_profile(OutputSpace space);

/// Returns primaries and white. XYZ counts as the RGB space whose primaries are the axes of XYZ (as OpenEXR readers
/// expect), its white the equal-energy point; nullopt for camera, whose primaries are not known.
std::optional<Chromaticities> chromaticities_of(OutputSpace space);

}  // namespace lowlux::isp
