#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/decoder/decoded_raw.h"
#include "isp/base/memory.h"

namespace lowlux::capture {

// This is the protocol between a decoder program and decode_contained(), which starts it. The last arguments of the
// program are decode_protocol, the process ID of its caller, the maximum number of pixels, and the processor time [s];
// file_descriptor holds the file, result_descriptor receives the DecodedHeader followed by the samples.

/// The version of the protocol in units of 1e9, plus the size of the header. Any change of meaning is a new version.
inline constexpr std::uint64_t decode_protocol = 2'000'000'000 + sizeof(DecodedHeader);
inline constexpr int result_descriptor = 3;
inline constexpr int file_descriptor = 4;
inline constexpr int wall_clock_factor = 5;  // wall-clock time for each unit of processor time
inline constexpr int wrong_protocol_exit = 2;
inline constexpr int no_memory_exit = 3;

/// Whether a decoder's memory is limited as well: not in builds with a sanitizer, whose shadow memory takes terabytes.
#if defined(LOWLUX_SANITIZED)
inline constexpr bool decoder_memory_is_limited = false;
#else
inline constexpr bool decoder_memory_is_limited = true;
#endif

/// Destination of a decoder's result.
class DecodeSink {
 public:
  explicit DecodeSink(int file) : file_(file) {}

  /// Appends samples, row by row in the order of the readout. Returns false if they cannot be written: the decoder must
  /// give up.
  bool write_samples(const std::uint16_t* samples, std::size_t count);
  /// Writes the header with the outcome; the last call.
  void finish(const DecodedHeader& header) const;

 private:
  int file_;
  std::uint64_t offset_ = sizeof(DecodedHeader);
};

using DecodeFunction = void (*)(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

/// Runs a decoder program: limits its own time and memory by its arguments, then decodes.
[[noreturn]] void run_decoder(std::span<char* const> arguments, DecodeFunction decode);

/// Repeats pread or pwrite, system calls that move bytes at an offset of a file, until all bytes are moved.
/// @return false if it fails or reaches the end of the file
template <class Byte, class Call>
bool move_all(Call call, int fd, std::span<Byte> bytes, std::uint64_t offset) {
  while (!bytes.empty()) {
    const ssize_t moved = call(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (moved < 0 && errno == EINTR) continue;
    if (moved <= 0) return false;
    offset += static_cast<std::uint64_t>(moved);
    bytes = bytes.subspan(static_cast<std::size_t>(moved));
  }
  return true;
}

inline bool read_all(int fd, std::span<std::byte> bytes, std::uint64_t offset) {
  return move_all(pread, fd, bytes, offset);
}

inline bool write_all(int fd, std::span<const std::byte> bytes, std::uint64_t offset) {
  return move_all(pwrite, fd, bytes, offset);
}

}  // namespace lowlux::capture
