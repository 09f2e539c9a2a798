#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lowlux {

/// Holds one tag of a file as it is stored there (TIFF 6.0, section 2).
struct SourceTag {
  std::uint16_t id = 0;
  std::uint16_t type = 0;         // 1 (BYTE) to 12 (DOUBLE)
  std::uint32_t count = 0;        // number of values
  std::vector<std::byte> values;  // little-endian, whatever the order of the file
};

/// Holds the tags of a raw file that lowlux passes on without using them: author, lens, place, maker's notes, XMP,
/// camera profile.
struct SourceTags {
  std::vector<SourceTag> main;  // tags of the first directory of a DNG
  std::vector<SourceTag> exif;
  std::vector<SourceTag> gps;
  double baseline_exposure_ev = 0;  // by how much raw developers brighten the image by default (DNG BaselineExposure)
};

/// Returns the bytes of the values of all tags.
std::size_t bytes_of(const SourceTags& tags);

/// Returns the tag of a list; null if it has none.
const SourceTag* find_tag(const std::vector<SourceTag>& tags, std::uint16_t id);

/// Returns an ASCII tag of a list up to its first zero byte; empty if there is none or it is of another type.
std::string text_of(const std::vector<SourceTag>& tags, std::uint16_t id);

}  // namespace lowlux
