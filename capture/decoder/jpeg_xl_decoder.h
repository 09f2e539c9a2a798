#pragma once

#include <cstddef>
#include <span>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {

/// Decodes the parts of a JpegXlJob, which is the file, with libjxl. It is a DecodeFunction for the program
/// lowlux-decode-jxl only.
void decode_with_libjxl(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

}  // namespace lowlux::capture
