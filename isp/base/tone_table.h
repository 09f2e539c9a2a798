#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace lowlux {

/// Holds a tone curve (transfer function included) over 0..1, tabulated for kernels: 0..1 in, display code out.
///
/// The bin of v is (bits(v + offset) - bits(offset)) >> shift, with bits() the float's bit pattern: bins are even steps
/// below `offset` and even steps per octave above it, so shadows get as many as highlights need. Bins never cross an
/// octave, so interpolation between edges is linear in v.
struct ToneTable {
  static constexpr int capacity = 4096;

  float offset = 0;
  int shift = 0;
  int bins = 0;                                // bins in use; the bin of v = 1 is the last
  std::array<std::int32_t, capacity> code8{};  // 0..255, at the centre of each bin
  std::array<float, capacity + 1> edge{};      // 0..1, at the lower edge of each bin; the upper edge of the
                                               // last may lie above, so that the line through it meets 1 at v = 1

  std::uint32_t base_bits() const { return std::bit_cast<std::uint32_t>(offset); }
  int bin_of(float v) const {
    return static_cast<int>((std::bit_cast<std::uint32_t>(v + offset) - base_bits()) >> shift);
  }
};

}  // namespace lowlux
