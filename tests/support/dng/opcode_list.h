#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/support/dng/tiff_writer.h"

namespace lowlux::test {

/// Holds one opcode of a DNG.
struct Opcode {
  std::uint32_t id = 0;
  std::vector<std::byte> parameters;
  std::uint32_t version = 0x01030000, flags = 1;
};

/// Returns an opcode list as DNG 1.7, chapter 7 lays it out, always big-endian.
inline Tag opcode_list(const std::vector<Opcode>& opcodes) {
  std::vector<std::byte> out;
  append_u32(out, static_cast<std::uint32_t>(opcodes.size()));
  for (const Opcode& opcode : opcodes) {
    append_u32(out, opcode.id);
    append_u32(out, opcode.version);
    append_u32(out, opcode.flags);
    append_u32(out, static_cast<std::uint32_t>(opcode.parameters.size()));
    out.insert(out.end(), opcode.parameters.begin(), opcode.parameters.end());
  }
  return Tag::opaque(std::move(out));
}

/// Returns an opcode whose parameters are numbers of 32 bits.
inline Opcode words(std::uint32_t id, const std::vector<std::uint32_t>& values) {
  Opcode out{.id = id};
  for (const std::uint32_t value : values) append_u32(out.parameters, value);
  return out;
}

inline constexpr std::uint16_t opcode_list1 = 51008, opcode_list2 = 51009, opcode_list3 = 51022;

}  // namespace lowlux::test
