#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/dng/tiff_directory.h"

namespace lowlux::capture {

/// A TIFF structure with EXIF data inside a raw file that is not a DNG.
struct ExifBlock {
  enum class First : std::uint8_t { main, exif, gps };  // what its first directory holds

  TiffFile tiff;
  First first = First::main;
};

/// Returns the EXIF data of a raw file, which they borrow: the file itself where it is a TIFF (CR2, NEF, ARW, PEF) or
/// one but for its mark (ORF, RW2), followed by the data of the JPEG image inside (RW2, RAF), or the boxes CMT1, CMT2
/// and CMT4 of a CR3. Where blocks have the same tag, that of the first one holds. Empty: none were found.
std::vector<ExifBlock> find_exif(std::span<const std::byte> file);

}  // namespace lowlux::capture
