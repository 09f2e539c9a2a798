#include "isp/base/packed/unpack_rows.h"

#if defined(__aarch64__)  // NEON only: SVE vectors have no fixed size and cannot be struct members
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/base/packed/unpack_rows.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace lowlux::unpack_rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Bytes = hn::ScalableTag<std::uint8_t>;
using Codes = hn::RepartitionToWide<Bytes>;
using Words = hn::RepartitionToWide<Codes>;
using HalfBytes = hn::Half<Bytes>;
using VB = hn::Vec<Bytes>;
using VC = hn::Vec<Codes>;

constexpr std::size_t vector_bytes = hn::MaxLanes(Bytes());
constexpr std::size_t vector_codes = hn::MaxLanes(Codes());
constexpr std::size_t widest_bytes = 64;  // vector size of the widest instruction set
constexpr std::uint8_t no_byte = 0x80;    // an index that gives zero

/// Copies the last bytes of a row, fewer than 2 kBytes, in blocks that fall by halves: none is read twice.
template <std::size_t kBytes>
HWY_INLINE void copy_rest(const std::uint8_t* from, std::size_t count, std::uint8_t* to) {
  if constexpr (kBytes > 0) {
    if ((count & kBytes) != 0) {
      std::memcpy(to, from, kBytes);
      from += kBytes, to += kBytes;
    }
    copy_rest<kBytes / 2>(from, count, to);
  }
}

/// Copies as memcpy does, but reads each byte once and in order: the C library reads both ends first and some bytes
/// twice.
HWY_INLINE void copy(const std::uint8_t* from, std::size_t count, std::uint8_t* to) {
  const Bytes b;
  std::size_t i = 0;
  for (; i + vector_bytes <= count; i += vector_bytes) hn::StoreU(hn::LoadU(b, from + i), b, to + i);
  copy_rest<vector_bytes / 2>(from + i, count - i, to + i);
}

/// Stores a full vector, or the first `left` of its codes.
HWY_INLINE void store(VC codes, std::uint16_t* out, std::size_t left) {
  const Codes c;
  if (HWY_LIKELY(left >= vector_codes)) return hn::StoreU(codes, c, out);
  HWY_ALIGN std::uint16_t rest[vector_codes];
  hn::Store(codes, c, rest);
  std::memcpy(out, rest, left * sizeof(*out));
}

constexpr std::size_t stage_pixels = 800;  // complete vectors and complete groups of any layout
constexpr std::size_t stage_bytes = stage_pixels * 14 / 8;
static_assert(stage_pixels % 25 == 0 && stage_pixels % (widest_bytes / 2) == 0);

/// Describes how eight codes are made from `bytes` bytes: 16-bit lane i is
///     high[i] << (bits - 8)  |  (the two bytes low[i] as little endian, times factor[i], modulo 2^16) >> low_shift
/// The factor moves the wanted bits to the top of the lane, where those above them are lost; vectors have no shifts
/// that differ by lane. These eight codes repeat within a run; only IPU3 has runs shorter than a stage.
struct Layout {
  std::size_t bytes = 0;
  std::size_t group_pixels = 0;
  std::size_t group_bytes = 0;
  std::size_t run_pixels = stage_pixels;
  std::size_t run_bytes = 0;
  int low_shift = 0;
  std::uint8_t high[8] = {no_byte, no_byte, no_byte, no_byte, no_byte, no_byte, no_byte, no_byte};
  std::uint8_t low[8][2] = {};
  std::uint16_t factor[8] = {};
};

constexpr Layout csi2_layout(std::size_t bits) {
  const std::size_t group = bits == 12 ? 2 : 4, low_bits = bits - 8;
  Layout out{
      .bytes = bits, .group_pixels = group, .group_bytes = group * bits / 8, .low_shift = static_cast<int>(24 - bits)};
  for (std::size_t i = 0; i < 8; ++i) {
    const std::size_t first = i / group * out.group_bytes, bit = i % group * low_bits, at = bit % 8;
    out.high[i] = static_cast<std::uint8_t>(first + i % group);
    out.low[i][0] = static_cast<std::uint8_t>(first + group + bit / 8);
    out.low[i][1] = at + low_bits > 8 ? static_cast<std::uint8_t>(out.low[i][0] + 1) : no_byte;
    out.factor[i] = static_cast<std::uint16_t>(1U << (16 - low_bits - at));
  }
  return out;
}

constexpr Layout ipu3_layout() {
  Layout out{.bytes = 10, .group_pixels = 25, .group_bytes = 32, .run_pixels = 25, .run_bytes = 32, .low_shift = 6};
  for (std::size_t i = 0; i < 8; ++i) {
    out.low[i][0] = static_cast<std::uint8_t>(10 * i / 8);
    out.low[i][1] = static_cast<std::uint8_t>(10 * i / 8 + 1);
    out.factor[i] = static_cast<std::uint16_t>(1U << (6 - 10 * i % 8));
  }
  return out;
}

constexpr Layout msb_first_10_layout() {
  Layout out{.bytes = 10, .group_pixels = 4, .group_bytes = 5, .low_shift = 6};
  for (std::size_t i = 0; i < 8; ++i) {
    out.low[i][0] = static_cast<std::uint8_t>(10 * i / 8 + 1);
    out.low[i][1] = static_cast<std::uint8_t>(10 * i / 8);
    out.factor[i] = static_cast<std::uint16_t>(1U << (10 * i % 8));
  }
  return out;
}

/// Holds a layout as vector instructions need it: a byte shuffle cannot cross 16 bytes, so a shuffle of 32-bit words
/// precedes it.
struct Pattern {
  std::int32_t word[widest_bytes / 4] = {};
  std::uint8_t high[widest_bytes] = {};
  std::uint8_t low[widest_bytes] = {};
  std::uint16_t factor[widest_bytes / 2] = {};
};

constexpr std::uint8_t moved(std::uint8_t index, std::size_t by) {
  return index == no_byte ? no_byte : static_cast<std::uint8_t>(index + by);
}

constexpr Pattern pattern_of(const Layout& layout) {
  Pattern out;
  for (std::size_t block = 0; block < widest_bytes / 16; ++block) {
    const std::size_t first = block * layout.bytes;
    for (std::size_t i = 0; i < 4; ++i) out.word[4 * block + i] = static_cast<std::int32_t>(first / 4 + i);
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t lane = 8 * block + i;
      out.high[2 * lane] = no_byte;
      out.high[2 * lane + 1] = moved(layout.high[i], first % 4);
      out.low[2 * lane] = moved(layout.low[i][0], first % 4);
      out.low[2 * lane + 1] = moved(layout.low[i][1], first % 4);
      out.factor[lane] = layout.factor[i];
    }
  }
  return out;
}

struct Csi2x10 {
  static constexpr Layout layout = csi2_layout(10);
  static constexpr Pattern pattern = pattern_of(layout);
};
struct Csi2x12 {
  static constexpr Layout layout = csi2_layout(12);
  static constexpr Pattern pattern = pattern_of(layout);
};
struct Csi2x14 {
  static constexpr Layout layout = csi2_layout(14);
  static constexpr Pattern pattern = pattern_of(layout);
};
struct Ipu3 {
  static constexpr Layout layout = ipu3_layout();
  static constexpr Pattern pattern = pattern_of(layout);
};
struct MsbFirst10 {
  static constexpr Layout layout = msb_first_10_layout();
  static constexpr Pattern pattern = pattern_of(layout);
};

/// Keeps a pattern in registers for the length of a row.
struct Registers {
  decltype(hn::SetTableIndices(Words(), Pattern().word)) word;
  VB high;
  VB low;
  VC factor;
};

/// Returns the codes of one vector; reads vector_bytes at `in`.
template <class Packing>
HWY_INLINE VC codes_of(const Registers& r, const std::uint8_t* in) {
  constexpr Layout layout = Packing::layout;
  const Codes c;
  VB bytes = hn::LoadU(Bytes(), in);
  if constexpr (vector_bytes > 16) {
    bytes = hn::BitCast(Bytes(), hn::TableLookupLanes(hn::BitCast(Words(), bytes), r.word));
  }
  const VC low = hn::BitCast(c, hn::TableLookupBytesOr0(bytes, r.low));
  const VC low_bits = hn::ShiftRight<layout.low_shift>(hn::Mul(low, r.factor));
  if constexpr (layout.high[0] == no_byte) {
    return low_bits;
  } else {
    const VC high = hn::BitCast(c, hn::TableLookupBytesOr0(bytes, r.high));
    return hn::Or(hn::ShiftRight<16 - int{layout.bytes}>(high), low_bits);
  }
}

/// Unpacks a row through a small buffer: the vectors at its end may read past the end, those of the row may not, and
/// where they overlap they would read slow camera memory twice. Prefetching keeps the memory busy meanwhile.
template <class Packing>
HWY_INLINE void put_packed(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  constexpr Layout layout = Packing::layout;
  const Registers r = {hn::SetTableIndices(Words(), Packing::pattern.word), hn::LoadU(Bytes(), Packing::pattern.high),
                       hn::LoadU(Bytes(), Packing::pattern.low), hn::LoadU(Codes(), Packing::pattern.factor)};
  HWY_ALIGN std::uint8_t stage[stage_bytes + widest_bytes];
  for (std::size_t first = 0; first < width; first += stage_pixels) {
    const std::size_t groups = (HWY_MIN(width - first, stage_pixels) + layout.group_pixels - 1) / layout.group_pixels;
    const std::size_t bytes = groups * layout.group_bytes;
    copy(in, bytes, stage);
    std::memset(stage + bytes, 0, widest_bytes);
    in += bytes;
    const std::size_t end = HWY_MIN(width, first + stage_pixels);
    const std::uint8_t* run = stage;
    for (std::size_t x = first; x < end; x += layout.run_pixels, run += layout.run_bytes) {
      for (std::size_t i = 0; i < layout.run_pixels && x + i < end; i += vector_codes) {
        const std::size_t at = i / 8 * layout.bytes;
        hwy::Prefetch(in + (run - stage) + at);  // prefetches the next stage, or row: harmless if there is none
        store(codes_of<Packing>(r, run + at), out + x + i, width - x - i);
      }
    }
  }
}

void PutCsi2x10(const std::uint8_t* in, std::size_t width, std::uint16_t* out) { put_packed<Csi2x10>(in, width, out); }
void PutCsi2x12(const std::uint8_t* in, std::size_t width, std::uint16_t* out) { put_packed<Csi2x12>(in, width, out); }
void PutCsi2x14(const std::uint8_t* in, std::size_t width, std::uint16_t* out) { put_packed<Csi2x14>(in, width, out); }
void PutIpu3(const std::uint8_t* in, std::size_t width, std::uint16_t* out) { put_packed<Ipu3>(in, width, out); }
void PutMsbFirst10(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  put_packed<MsbFirst10>(in, width, out);
}

/// Loads the first `left` bytes, with zeros after them.
template <class Tag>
HWY_INLINE hn::Vec<Tag> load(Tag tag, const std::uint8_t* in, std::size_t left) {
  constexpr std::size_t whole = hn::MaxLanes(Tag());
  if (HWY_LIKELY(left >= whole)) return hn::LoadU(tag, in);
  HWY_ALIGN std::uint8_t rest[whole] = {};
  copy_rest<whole / 2>(in, left, rest);
  return hn::Load(tag, rest);
}

void PutBytes(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  const HalfBytes half;
  for (std::size_t i = 0; i < width; i += vector_codes) {
    store(hn::PromoteTo(Codes(), load(half, in + i, width - i)), out + i, width - i);
  }
}

void PutBig16(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  for (std::size_t i = 0; i < width; i += vector_codes) {
    const VC swapped = hn::BitCast(Codes(), load(Bytes(), in + 2 * i, 2 * (width - i)));
    store(hn::Or(hn::ShiftLeft<8>(swapped), hn::ShiftRight<8>(swapped)), out + i, width - i);
  }
}

void PutLittle16(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  copy(in, 2 * width, reinterpret_cast<std::uint8_t*>(out));
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::unpack_rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::unpack_rows {

HWY_EXPORT(PutBytes);
HWY_EXPORT(PutLittle16);
HWY_EXPORT(PutBig16);
HWY_EXPORT(PutCsi2x10);
HWY_EXPORT(PutCsi2x12);
HWY_EXPORT(PutCsi2x14);
HWY_EXPORT(PutIpu3);
HWY_EXPORT(PutMsbFirst10);
HWY_EXPORT(TargetName);

void put_bytes(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutBytes)(in, width, out);
}
void put_little16(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutLittle16)(in, width, out);
}
void put_big16(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutBig16)(in, width, out);
}
void put_csi2_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutCsi2x10)(in, width, out);
}
void put_csi2_12(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutCsi2x12)(in, width, out);
}
void put_csi2_14(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutCsi2x14)(in, width, out);
}
void put_ipu3(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutIpu3)(in, width, out);
}
void put_msb_first_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(PutMsbFirst10)(in, width, out);
}
const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace lowlux::unpack_rows
#endif
