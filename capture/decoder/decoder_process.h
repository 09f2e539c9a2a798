#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "capture/decoder/decoded_raw.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Runs a decoder program on a file, so that its crash, endless loop or use of too much memory becomes an Error here.
/// It can take the time and memory that follow from the limits, and no more. What it reports is checked: sizes are
/// within the limits, texts end, and all samples are there.
///
/// The program is started by posix_spawn: it shares no memory with this process, nor any lock that a thread of it
/// holds. May be called from any thread.
/// @param command  the program and its first arguments; those of decoder_program.h follow
Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits,
                                    std::vector<std::string> command);

/// The same by lowlux-decode, which runs LibRaw. It lies in the folder of this library or, once installed, in lowlux/
/// below it.
Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits);

}  // namespace lowlux::capture
