#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/dng/dng_storage.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Returns an error unless the image is a lossy one that decode_lossy_image reads: LinearRaw of 8 bits, with 1 or 3
/// samples, in baseline JPEG (DNG 1.4, Compression 34892), with all of its parts inside the file.
Result<void> check_lossy_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Decodes the strips or tiles of a lossy image to its 8-bit codes, height x (width * samples). As other readers do,
/// the markers of each JPEG decide whether it holds RGB or YCbCr. Errors: a part that is not a JPEG of the size of its
/// place, or is damaged.
Result<Plane<std::uint16_t>> decode_lossy_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                const DngImage& image);

}  // namespace lowlux::capture
