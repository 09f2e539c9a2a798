#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/decoder/decoded_raw.h"
#include "isp/base/memory.h"

namespace lowlux::capture {

// The protocol between a decoder program and decode_contained(), which starts it. The last arguments of the program are
// decode_protocol, the process ID of its caller, the maximum number of pixels, and the processor time [s];
// file_descriptor has the file, result_descriptor takes the DecodedHeader and behind it the samples.

/// The version of the protocol in units of 1e9, plus the size of the header. Any change of meaning is a new version.
inline constexpr std::uint64_t decode_protocol = 2'000'000'000 + sizeof(DecodedHeader);
inline constexpr int result_descriptor = 3;
inline constexpr int file_descriptor = 4;
inline constexpr int wall_clock_factor = 5;  // time by the clock for one of the processor
inline constexpr int wrong_protocol_exit = 2;
inline constexpr int no_memory_exit = 3;

/// Whether a decoder's memory is limited too: not in builds with a sanitizer, whose shadow memory takes terabytes.
#if defined(LOWLUX_SANITIZED)
inline constexpr bool decoder_memory_is_limited = false;
#else
inline constexpr bool decoder_memory_is_limited = true;
#endif

/// Where a decoder leaves its result.
class DecodeSink {
 public:
  explicit DecodeSink(int file) : file_(file) {}

  /// Appends samples, row by row in the order of the readout. False: nowhere to put them, give up.
  bool write_samples(const std::uint16_t* samples, std::size_t count);
  /// States how decoding went; the last call.
  void finish(const DecodedHeader& header) const;

 private:
  int file_;
  std::uint64_t offset_ = sizeof(DecodedHeader);
};

using DecodeFunction = void (*)(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

/// All that a decoder program does: limits its own time and memory by its arguments, then decodes.
[[noreturn]] void run_decoder(std::span<char* const> arguments, DecodeFunction decode);

}  // namespace lowlux::capture
