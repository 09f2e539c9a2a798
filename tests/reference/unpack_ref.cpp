#include "tests/reference/unpack_ref.h"

namespace lowlux::reference {
namespace {

struct BitPlace {
  std::size_t byte;
  unsigned bit;  // 0 is the least significant
};

/// Returns the position of one bit in a run of bits that begins with the least significant of each byte.
BitPlace in_run(std::size_t first_byte, std::size_t position) {
  return {first_byte + position / 8, static_cast<unsigned>(position % 8)};
}

/// Returns where bit `bit` of column x lies.
BitPlace place_of(const RawFormat& format, std::size_t x, unsigned bit) {
  const auto bits = static_cast<unsigned>(format.bits);
  switch (format.packing) {
    case RawPacking::byte:
      return {x, bit};
    case RawPacking::little16:
      return {2 * x + bit / 8, bit % 8};
    case RawPacking::big16:
      return {2 * x + 1 - bit / 8, bit % 8};
    case RawPacking::ipu3:
      return in_run(x / 25 * 32, x % 25 * 10 + bit);
    case RawPacking::bits_msb_first: {
      const std::size_t position = x * bits + (bits - 1 - bit);
      return {position / 8, static_cast<unsigned>(7 - position % 8)};
    }
    case RawPacking::csi2:
      break;
  }
  const std::size_t group = bits == 12 ? 2 : 4, first = x / group * (group * bits / 8);
  const unsigned low_bits = bits - 8;
  if (bit >= low_bits) return {first + x % group, bit - low_bits};
  return in_run(first + group, x % group * low_bits + bit);
}

}  // namespace

std::uint16_t unpacked_code(const RawFormat& format, const std::byte* row, int x) {
  const bool whole_words = format.packing == RawPacking::little16 || format.packing == RawPacking::big16;
  const auto bits = whole_words ? 16U : static_cast<unsigned>(format.bits);
  unsigned code = 0;
  for (unsigned bit = 0; bit < bits; ++bit) {
    const BitPlace place = place_of(format, static_cast<std::size_t>(x), bit);
    code |= (std::to_integer<unsigned>(row[place.byte]) >> place.bit & 1U) << bit;
  }
  return static_cast<std::uint16_t>(code);
}

}  // namespace lowlux::reference
