#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {

/// Header of the input of lowlux-decode-jxl. It is followed by `parts` sizes [bytes] of 64 bits each, and the parts,
/// each a JPEG XL of the samples of one strip or tile. The output has the samples of the image, codes of `bits` bits.
struct JpegXlJob {
  std::int32_t width, height;            // of the image [pixels]
  std::int32_t samples;                  // per pixel, 1 or 3
  std::int32_t bits;                     // of a code, 8 to 16
  std::int32_t part_width, part_height;  // the parts cover the image row after row; the last ones may be smaller
  std::uint64_t parts;
};
static_assert(std::is_trivially_copyable_v<JpegXlJob>);

/// Decodes the parts of a JpegXlJob, which is the file, with libjxl. It is a DecodeFunction for the program
/// lowlux-decode-jxl only.
void decode_with_libjxl(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

}  // namespace lowlux::capture
