#pragma once

#include <cstddef>
#include <span>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Reads a binary portable pixmap (Netpbm, "P6") or greymap ("P5", as three equal channels). The header may hold
/// comments. Samples of up to 255 become 8 bits, larger ones, which are big-endian, 16 bits; a maximum other than 255
/// and 65535 is scaled to it, rounded. Bytes after the last row are ignored. The format states no colour space.
/// Errors: a header that is not of this form; a sample above the stated maximum; too few samples; the limits.
Result<DecodedPicture> decode_ppm(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
