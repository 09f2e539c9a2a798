#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/dng/dng_storage.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/result.h"

/// Lossless JPEG in more than one strip, of which LibRaw 0.20 and 0.21 decode the first one only. It decodes tiles, and
/// takes those without TileWidth to be as wide as the image: the strips are presented to it as tiles.
namespace lowlux::capture {

/// Returns whether an image is in lossless JPEG, in more than one strip.
bool is_jpeg_in_strips(const TiffDirectory& directory);

/// Returns the error of strips that cannot be presented as tiles, or are not all inside the file.
Result<void> check_jpeg_strips(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Replaces the tags of strips by those of tiles in a copy of the file. Errors: those of check_jpeg_strips; a strip
/// whose JPEG has fewer samples than its rows, which LibRaw would leave at zero.
Result<void> present_strips_as_tiles(const TiffDirectory& directory, const DngImage& image,
                                     std::vector<std::byte>& file);

/// Replaces the number of a tag in a copy of the file; 0 hides it.
void set_tag(const TiffEntry& entry, std::uint16_t id, std::vector<std::byte>& file);

}  // namespace lowlux::capture
