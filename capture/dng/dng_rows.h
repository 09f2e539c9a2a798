#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/dng/dng_storage.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

/// Images whose strips or tiles are uncompressed, deflated or in lossless JPEG are read here: integers of 8 to 16 bits
/// that LibRaw would misplace or not decode (is_for_libraw), and floating-point numbers of 16, 24 and 32 bits, which
/// LibRaw converts to 14-bit codes. Predictors, and images stored colour after colour, are supported.
namespace lowlux::capture {

/// Returns the error of an image whose storage is not supported or contradicts itself, or whose data are too short for
/// its pixels. It allocates no memory for pixels.
Result<void> check_row_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Returns whether LibRaw 0.20 reads this image of integers, uncompressed or in lossless JPEG: in a classic TIFF, 22 to
/// 64,000 pixels wide and high; uncompressed row after row without a gap and not in tiles; JPEG in one strip, or in
/// tiles of a coloured image that are not wider than the image.
bool is_for_libraw(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Returns an error if a strip or tile of an image in lossless JPEG does not contain a JPEG image, or one with fewer
/// samples than its rows have. LibRaw would leave the missing ones black.
Result<void> check_jpeg_samples(std::span<const std::byte> file, const TiffDirectory& directory, const DngImage& image);

/// Both decode an image that check_row_image accepts, to height x (width * samples).
/// @param file  all bytes
/// @return codes as stored, or floats of any values, NaN included
/// Errors: those of check_row_image; damaged or truncated streams.
Result<Plane<std::uint16_t>> decode_code_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                               const DngImage& image);
Result<Plane<float>> decode_float_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                        const DngImage& image);

}  // namespace lowlux::capture
