#pragma once

#include <cstddef>
#include <span>

#include "capture/dng/dng_storage.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

/// Floating-point images of DNG 1.4 are read here, because LibRaw converts them to 14-bit codes or loses values below
/// black: 16, 24 and 32 bits; strips or tiles; uncompressed, or Deflate with or without the floating-point predictors.
namespace lowlux::capture {

/// Returns the error of a floating-point image whose storage is not supported or contradicts itself, or whose data are
/// too short for its pixels. It allocates no memory for pixels.
Result<void> check_float_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Decodes a floating-point image that check_float_image accepts.
/// @param file  all bytes
/// @return height x (width * samples); any values, NaN included
/// Errors: those of check_float_image; damaged or truncated streams.
Result<Plane<float>> decode_float_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                        const DngImage& image);

}  // namespace lowlux::capture
