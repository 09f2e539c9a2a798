#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {

/// Decodes the mosaic of a raw file with LibRaw: unpacking only, none of its processing. A DecodeFunction, in the
/// program lowlux-decode only.
void decode_with_libraw(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

/// "LibRaw 0.20.2": for messages.
std::string decoder_name();

}  // namespace lowlux::capture
