#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/dng/dng_storage.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads the geometry (active area, crop, masked areas) of a raw image from its tags. `raw.dn` is not needed. A damaged
/// ActiveArea is an error; damaged tags for the crop, masked areas and scale are ignored with a warning.
Result<void> read_geometry(const TiffDirectory& directory, const DngImage& image, RawDn& raw,
                           std::vector<std::string>& warnings);

/// Reads DefaultScale, two numbers above zero; nullopt if there is no such tag.
Result<std::optional<std::vector<double>>> read_scale(const TiffDirectory& directory);

/// Reads black and white levels. Precondition: the geometry is filled. White levels not above black are an error. Black
/// that is not stated is 0 for floating-point samples and images of three samples, and otherwise absent. A black level
/// of as many values as the cell of the mosaic has sites, without BlackLevelRepeatDim, gives a warning.
Result<void> read_levels(const TiffDirectory& directory, const DngImage& image, RawDn& raw,
                         std::vector<std::string>& warnings);

/// Replaces codes by their values in LinearizationTable, if there is one; those beyond it get its last value. Errors: a
/// damaged table.
Result<void> apply_linearization_table(const TiffDirectory& directory, Plane<std::uint16_t>& codes);

/// Returns the regions of a readout outside its active area, as up to four rectangles that do not overlap.
std::vector<Rect> borders(int width, int height, const Rect& active);

/// Returns an error for white levels that are not above black, with both values. `source` states their origin.
Result<void> check_levels(const RawDn& raw, const std::string& source);

}  // namespace lowlux::capture
