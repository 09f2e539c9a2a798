#include "isp/render/retarget/retarget_rows.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/render/retarget/retarget_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::retarget::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
using Ints = hn::RebindToSigned<Floats>;
using VI = hn::Vec<Ints>;
using Unsigned = hn::RebindToUnsigned<Floats>;
using Codes = hn::Repartition<std::uint16_t, Floats>;
using VC = hn::Vec<Codes>;

constexpr int max_pixels_at_once() { return 2 * static_cast<int>(hn::MaxLanes(Floats())); }

/// Holds one vector for each of R, G and B.
template <class V>
struct Three {
  V c[3];
};

struct Table {
  const std::int32_t* nodes;
  float levels;
  VF scale;
  VI last_cell;
  VI stride[3];
  VI diagonal;

  explicit HWY_INLINE Table(const RetargetTable& table)
      : nodes(table.nodes.data()),
        levels(static_cast<float>(table.levels)),
        scale(hn::Set(Floats(), static_cast<float>(table.levels - 1) / 65535.0f)),
        last_cell(hn::Set(Ints(), table.levels - 2)),
        stride{hn::Set(Ints(), 2 * table.levels * table.levels), hn::Set(Ints(), 2 * table.levels), hn::Set(Ints(), 2)},
        diagonal(hn::Add(hn::Add(stride[0], stride[1]), stride[2])) {}

  /// Adds weight times node, in codes of 16 bits.
  HWY_INLINE void add(VI at, VF weight, Three<VF>& sum) const {
    const Floats f;
    const VI first = hn::GatherIndex(Ints(), nodes, at), second = hn::GatherIndex(Ints(), nodes + 1, at);
    const VI red = hn::And(first, hn::Set(Ints(), 0xFFFF));
    const VI green = hn::BitCast(Ints(), hn::ShiftRight<16>(hn::BitCast(Unsigned(), first)));
    sum.c[0] = hn::MulAdd(weight, hn::ConvertTo(f, red), sum.c[0]);
    sum.c[1] = hn::MulAdd(weight, hn::ConvertTo(f, green), sum.c[1]);
    sum.c[2] = hn::MulAdd(weight, hn::ConvertTo(f, second), sum.c[2]);
  }

  /// Nodes are numbered in floats, which hold them exactly: products of 32-bit integers are slow before SSE4.
  HWY_INLINE Three<VF> at(const Three<VI>& code) const {
    const Floats f;
    VF cell[3], x[3];
    for (int c = 0; c < 3; ++c) {
      const VF place = hn::Mul(hn::ConvertTo(f, code.c[c]), scale);
      cell[c] = hn::ConvertTo(f, hn::Min(hn::ConvertTo(Ints(), place), last_cell));
      x[c] = hn::Sub(place, cell[c]);
    }
    const VF n = hn::Set(f, levels);
    const VF number = hn::MulAdd(hn::MulAdd(cell[0], n, cell[1]), n, cell[2]);
    const VI origin = hn::ConvertTo(Ints(), hn::Add(number, number));
    const VF high = hn::Max(x[0], hn::Max(x[1], x[2])), low = hn::Min(x[0], hn::Min(x[1], x[2]));
    const VF middle = hn::Max(hn::Min(x[0], x[1]), hn::Min(hn::Max(x[0], x[1]), x[2]));
    const auto choose = [](auto mask, VI yes, VI no)
                            HWY_ATTR { return hn::IfThenElse(hn::RebindMask(Ints(), mask), yes, no); };
    const VI along_high = choose(hn::And(hn::Ge(x[0], x[1]), hn::Ge(x[0], x[2])), stride[0],
                                 choose(hn::Ge(x[1], x[2]), stride[1], stride[2]));
    const VI along_low = choose(hn::And(hn::Le(x[2], x[1]), hn::Le(x[2], x[0])), stride[2],
                                choose(hn::Le(x[1], x[0]), stride[1], stride[0]));
    const VI far = hn::Add(origin, diagonal);
    const VF zero = hn::Zero(f);
    Three<VF> sum{{zero, zero, zero}};
    add(origin, hn::Sub(hn::Set(f, 1.0f), high), sum);
    add(hn::Add(origin, along_high), hn::Sub(high, middle), sum);
    add(hn::Sub(far, along_low), hn::Sub(middle, low), sum);
    add(far, low, sum);
    return sum;
  }
};

HWY_INLINE VI rounded(VF code, float scale, int most) {
  const VI nearest = hn::NearestInt(hn::Mul(code, hn::Set(Floats(), scale)));
  return hn::Min(hn::Max(nearest, hn::Zero(Ints())), hn::Set(Ints(), most));
}

// The structs below store finished pixels: a vector of each colour, even pixels and odd ones.

struct To8 {
  using Code = std::uint8_t;
  static HWY_INLINE auto joined(VF even, VF odd) {
    const hn::Rebind<std::uint16_t, Floats> u16;
    const hn::Repartition<std::uint8_t, decltype(u16)> u8;
    constexpr float scale = 255.0f / 65535.0f;
    const VI pair = hn::Or(rounded(even, scale, 255), hn::ShiftLeft<8>(rounded(odd, scale, 255)));
    return hn::BitCast(u8, hn::TruncateTo(u16, hn::BitCast(Unsigned(), pair)));
  }
  static HWY_INLINE void store(const Three<VF>& even, const Three<VF>& odd, Code* out) {
    const hn::Repartition<std::uint8_t, hn::Rebind<std::uint16_t, Floats>> u8;
    const auto r = joined(even.c[0], odd.c[0]), g = joined(even.c[1], odd.c[1]), b = joined(even.c[2], odd.c[2]);
    hn::StoreInterleaved3(r, g, b, u8, out);
  }
};

struct To16 {
  using Code = std::uint16_t;
  static HWY_INLINE VC joined(VF even, VF odd) {
    return hn::BitCast(Codes(), hn::Or(rounded(even, 1, 65535), hn::ShiftLeft<16>(rounded(odd, 1, 65535))));
  }
  static HWY_INLINE void store(const Three<VF>& even, const Three<VF>& odd, Code* out) {
    const VC r = joined(even.c[0], odd.c[0]), g = joined(even.c[1], odd.c[1]), b = joined(even.c[2], odd.c[2]);
    hn::StoreInterleaved3(r, g, b, Codes(), out);
  }
};

HWY_INLINE Three<VI> even_of(const Three<VC>& codes) {
  const VI mask = hn::Set(Ints(), 0xFFFF);
  return {{hn::And(hn::BitCast(Ints(), codes.c[0]), mask), hn::And(hn::BitCast(Ints(), codes.c[1]), mask),
           hn::And(hn::BitCast(Ints(), codes.c[2]), mask)}};
}

HWY_INLINE Three<VI> odd_of(const Three<VC>& codes) {
  const auto high = [](VC v) HWY_ATTR { return hn::BitCast(Ints(), hn::ShiftRight<16>(hn::BitCast(Unsigned(), v))); };
  return {{high(codes.c[0]), high(codes.c[1]), high(codes.c[2])}};
}

/// Converts a row; the last, partial vector is processed in the same way, through copies.
template <class Sink>
HWY_INLINE void convert(const RetargetTable& from, const std::uint16_t* rgb, int width, typename Sink::Code* out) {
  using Code = typename Sink::Code;
  const Table table(from);
  const int pixels = 2 * static_cast<int>(hn::Lanes(Floats()));
  HWY_ALIGN std::uint16_t last_in[3 * max_pixels_at_once()] = {};
  HWY_ALIGN Code last_out[3 * max_pixels_at_once()];
  for (int x = 0; x < width; x += pixels) {
    const std::ptrdiff_t place = 3 * static_cast<std::ptrdiff_t>(x);
    const bool partial = width - x < pixels;
    const std::size_t rest = 3 * static_cast<std::size_t>(width - x);
    if (partial) std::memcpy(last_in, rgb + place, rest * sizeof *rgb);
    VC r, g, b;
    hn::LoadInterleaved3(Codes(), partial ? last_in : rgb + place, r, g, b);
    const Three<VC> codes{{r, g, b}};
    Sink::store(table.at(even_of(codes)), table.at(odd_of(codes)), partial ? last_out : out + place);
    if (partial) std::memcpy(out + place, last_out, rest * sizeof *out);
  }
}

void RowTo8(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint8_t* out) {
  convert<To8>(table, rgb, width, out);
}
void RowTo16(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint16_t* out) {
  convert<To16>(table, rgb, width, out);
}

}  // namespace lowlux::isp::retarget::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp {
namespace retarget {
HWY_EXPORT(RowTo8);
HWY_EXPORT(RowTo16);
}  // namespace retarget

void apply(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint8_t* out) {
  using namespace retarget;
  HWY_DYNAMIC_DISPATCH(RowTo8)(table, rgb, width, out);
}
void apply(const RetargetTable& table, const std::uint16_t* rgb, int width, std::uint16_t* out) {
  using namespace retarget;
  HWY_DYNAMIC_DISPATCH(RowTo16)(table, rgb, width, out);
}

}  // namespace lowlux::isp
#endif
