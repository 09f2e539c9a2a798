// Rows of any raw format and width: the kernels agree with the reference and stay inside of exactly sized memory.
// Input: format, two bytes that choose among the widths the rest is enough for, the row.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "tests/fuzz/input.h"
#include "tests/reference/unpack_ref.h"

LOWLUX_FUZZ_TARGET(unpack)(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  const auto formats = lowlux::raw_formats();
  const lowlux::RawFormat& format = formats[data[0] % formats.size()].format;
  const lowlux::RawGroup group = lowlux::group_of(format);
  const auto widest = static_cast<int>((size - 3) / group.bytes) * group.pixels;
  const int width = widest - (data[1] << 8 | data[2]) % (widest + 1);
  const std::size_t bytes = lowlux::row_bytes(format, width);
  if (bytes > size - 3) std::abort();
  std::vector<std::byte> row(bytes);  // a copy that ends where the row does
  if (bytes > 0) std::memcpy(row.data(), data + 3, bytes);
  std::vector<std::uint16_t> codes(width);
  lowlux::unpack_row(format, row.data(), width, codes.data());
  for (int x = 0; x < width; ++x) {
    if (codes[x] != lowlux::reference::unpacked_code(format, row.data(), x)) std::abort();
  }
  return 0;
}
