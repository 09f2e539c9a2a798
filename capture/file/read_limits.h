#pragma once

#include <cstdint>

namespace lowlux::capture {

/// What reading one file may take. Each is checked before the memory is taken or the time is spent.
struct ReadLimits {
  std::uint64_t max_file_bytes = std::uint64_t{2} << 30;
  std::int64_t max_pixels = 400'000'000;  // of the readout, borders included
  double max_decode_cpu_s = 120;          // rounded up to whole seconds; the wall clock gets five times as much
};

}  // namespace lowlux::capture
