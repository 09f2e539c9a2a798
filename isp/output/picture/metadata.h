#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/source_tags.h"

namespace lowlux::isp {

/// Holds the contents of an EXIF block on the image itself, not on its exposure.
struct ExifPicture {
  int width = 0;
  int height = 0;
  OutputSpace space = OutputSpace::srgb;
  std::string software;                     // producer of the image, e.g. "lowlux 0.1.0"
  const SourceTags* source_tags = nullptr;  // tags of the raw file; they do not replace tags that the block has
};

/// Returns an EXIF 2.32 block from its TIFF header on (little-endian). What is absent in `info` stays absent;
/// orientation is always 1, because pixels are rotated before they are written. Times that are not "YYYY:MM:DD
/// hh:mm:ss" and numbers that are not positive are left out; text keeps its printable ASCII, at most 255 characters.
std::vector<std::byte> exif_block(const FrameInfo& info, const ExifPicture& picture);

/// Returns the printable ASCII of a text, at most `limit` characters: what EXIF and TIFF fields may hold.
std::string printable_ascii(const std::string& text, std::size_t limit);

/// Returns `info` as it applies to the finished image: upright, made by `software`, with clean text.
FrameInfo written_info(const FrameInfo& info, const std::string& software);

}  // namespace lowlux::isp
