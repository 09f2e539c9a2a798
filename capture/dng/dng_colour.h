#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/dng/dng_file.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads the colour calibrations and the as-shot white of a DNG; tags of the first directory take precedence over those
/// of the raw image. A tag with a NaN value, or a matrix without an inverse, is ignored with a warning that names it.
CameraColour read_colour(const DngFile& dng, const TiffDirectory& raw_image, std::vector<std::string>& warnings);

/// Returns the error of a damaged ColorMatrix, for use if neither the other one nor the decoder's table is available:
/// the image then needs it.
Result<void> check_colour_matrices(const DngFile& dng, const TiffDirectory& raw_image);

/// Removes an as-shot white that no light can have under the calibrations, with a warning.
void ignore_impossible_white(CameraColour& colour, std::vector<std::string>& warnings);

/// Reads the noise profile; nullopt if the file states none. `planes` is 3, or 1 for monochrome.
Result<std::optional<NoiseProfile>> read_noise(const DngFile& dng, const TiffDirectory& raw_image, int planes);

/// Returns the correlated colour temperature [K] of an EXIF LightSource code (EXIF 2.31, 4.6.5, tag 37384), which DNG's
/// CalibrationIlluminant uses; 0 for codes without one.
double illuminant_cct_k(std::uint32_t light_source);

}  // namespace lowlux::capture
