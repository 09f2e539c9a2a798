#pragma once

#include <cstddef>

#include "capture/dng/dng_storage.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Returns the size and layout of a raw image; a specific error for an image that cannot be decoded or developed, and
/// for image data that extend beyond the file. `file_bytes` is the size of the file.
Result<DngImage> dng_image(const TiffDirectory& directory, std::size_t file_bytes);

}  // namespace lowlux::capture
