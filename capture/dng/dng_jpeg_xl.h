#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/decoder/decoded_raw.h"
#include "capture/dng/dng_storage.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Returns an error unless the parts of an image in JPEG XL (DNG 1.7, Compression 52546) are inside the file.
Result<void> check_jpeg_xl_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Decodes the strips or tiles of an image in JPEG XL to its codes, height x (width * samples), in a program of its own
/// (decoder_process.h). Samples in XYB are those of the colours that the JPEG XL names. Errors: libjxl is not
/// installed; a part that is damaged or does not have the size and channels of its place; those of decode_contained.
Result<Plane<std::uint16_t>> decode_jpeg_xl_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                  const DngImage& image, const ReadLimits& limits);

}  // namespace lowlux::capture
