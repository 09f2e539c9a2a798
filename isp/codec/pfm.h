#pragma once

#include <cstddef>
#include <cstdio>
#include <span>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {

// Portable float maps, as defined by P. Debevec (http://www.pauldebevec.com/Research/HDR/PFM/), have a text header of
// "PF" (RGB) or "Pf" (grey), width, height and a scale, then rows of 32-bit floats from the bottom of the image up. The
// sign of the scale states their byte order: negative is little-endian.

/// Writes RGB, little-endian, scale -1.0; any value, NaN included, is preserved exactly. The format cannot hold
/// metadata.
Result<void> encode_pfm(const SceneLinear& picture, std::FILE* file);

/// Writes one plane as a grey PFM.
Result<void> encode_pfm(PlaneView<const float> plane, std::FILE* file);

/// Reads RGB, and grey as three equal planes, of either byte order. Bytes after the last row are ignored. A scale other
/// than 1 and -1 is an error: writers disagree on whether values are to be multiplied or divided by it.
Result<DecodedPicture> decode_pfm(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
