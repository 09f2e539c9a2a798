#include "isp/base/unpack.h"

#include <cassert>

#include "isp/base/unpack_rows.h"

namespace lowlux {

void unpack_row(const RawFormat& format, const std::byte* in, int width, std::uint16_t* out) {
  assert(names_of(format) != nullptr);
  if (width <= 0) return;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(in);
  const auto count = static_cast<std::size_t>(width);
  switch (format.packing) {
    case RawPacking::byte:
      return unpack_rows::put_bytes(bytes, count, out);
    case RawPacking::little16:
      return unpack_rows::put_little16(bytes, count, out);
    case RawPacking::big16:
      return unpack_rows::put_big16(bytes, count, out);
    case RawPacking::ipu3:
      return unpack_rows::put_ipu3(bytes, count, out);
    case RawPacking::bits_msb_first:
      return unpack_rows::put_msb_first_10(bytes, count, out);
    case RawPacking::csi2:
      if (format.bits == 10) return unpack_rows::put_csi2_10(bytes, count, out);
      if (format.bits == 12) return unpack_rows::put_csi2_12(bytes, count, out);
      return unpack_rows::put_csi2_14(bytes, count, out);
  }
}

const char* unpack_target() { return unpack_rows::target_name(); }

}  // namespace lowlux
