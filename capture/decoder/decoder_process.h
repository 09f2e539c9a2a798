#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/decoder/decoded_raw.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Runs a decoder program on a file, so that its crash, endless loop or excessive use of memory becomes an Error here.
/// Its time and memory are bounded by the limits. Its results are checked: sizes are within the limits, texts are
/// terminated, and all samples are present.
///
/// The program is started by posix_spawn: it shares no memory with this process, nor any lock that a thread of it
/// holds. May be called from any thread.
/// @param command  the program and its first arguments; those of decoder_program.h are appended
Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits,
                                    std::vector<std::string> command);

/// Lists the programs that decode in a separate process.
enum class DecoderProgram : std::uint8_t {
  libraw,  // lowlux-decode, of raw files
  libjxl,  // lowlux-decode-jxl, of a JpegXlJob; built where libjxl is
};

/// Runs a program of lowlux on a file. The program is in the folder of this library or, once installed, in lowlux/
/// below it. Errors: those of the decoder, and that of a missing program.
Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits,
                                    DecoderProgram program = DecoderProgram::libraw);

}  // namespace lowlux::capture
