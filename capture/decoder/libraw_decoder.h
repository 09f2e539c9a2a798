#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {

/// Decodes the mosaic of a raw file with LibRaw: unpacking only, without its processing. It is a DecodeFunction for the
/// program lowlux-decode only.
void decode_with_libraw(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

/// Returns the decoder's name for messages, "LibRaw 0.20.2".
std::string decoder_name();

}  // namespace lowlux::capture
