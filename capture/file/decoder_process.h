#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/file/decoded_raw.h"
#include "capture/file/read_limits.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Where a decoder running in its own process leaves its result.
class DecodeSink {
 public:
  explicit DecodeSink(int file) : file_(file) {}

  /// Appends samples, row by row in the order of the readout. False: nowhere to put them, give up.
  bool write_samples(const std::uint16_t* samples, std::size_t count);
  /// Says how decoding went; the last call.
  void finish(const DecodedHeader& header) const;

 private:
  int file_;
  std::uint64_t offset_ = sizeof(DecodedHeader);
};

using DecodeFunction = void (*)(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink);

/// Runs a decoder in a child process, so that its crash, endless loop or hunger for memory becomes an Error here.
/// The child can take the time and memory that follow from the limits, and no more. May be called from any thread.
/// What the decoder reports is checked: sizes are within the limits, texts end, and all samples are there.
Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits, DecodeFunction decode);

/// Whether the child's memory is limited too: not in builds with a sanitizer, which need a vast address space.
bool decoder_memory_is_limited();

}  // namespace lowlux::capture
