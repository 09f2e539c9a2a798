#pragma once

#include <cstdint>
#include <type_traits>

namespace lowlux::capture {

/// Header of the input of lowlux-decode-jxl. It is followed by `parts` sizes [bytes] of 64 bits each, and the parts,
/// each a JPEG XL of the samples of one strip or tile. The output has the samples of the image, codes of `bits` bits.
struct JpegXlJob {
  std::int32_t width, height;            // size of the image [pixels]
  std::int32_t samples;                  // per pixel, 1 or 3
  std::int32_t bits;                     // bits of a code, 8 to 16
  std::int32_t part_width, part_height;  // the parts cover the image row after row; the last ones may be smaller
  std::uint64_t parts;
};
static_assert(std::is_trivially_copyable_v<JpegXlJob>);

}  // namespace lowlux::capture
