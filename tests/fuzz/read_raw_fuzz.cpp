// The reader on arbitrary bytes: errors are good, crashes and large allocations are bad. What crashes inside of
// LibRaw stays in its own process and is an error here.
#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/file/dng_source.h"
#include "tests/fuzz/check_frame.h"
#include "tests/fuzz/input.h"

LOWLUX_FUZZ_TARGET(read_raw)(const std::uint8_t* data, std::size_t size) {
  const lowlux::capture::ReadLimits limits{.max_file_bytes = 1 << 20, .max_pixels = 4'000'000, .max_decode_cpu_s = 2};
  const auto frame = lowlux::capture::read_raw(std::as_bytes(std::span(data, size)), "fuzz", limits);
  if (frame) lowlux::test::check(*frame);
  return 0;
}
