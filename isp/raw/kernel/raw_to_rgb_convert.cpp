#include <cstddef>
#include <cstdint>
#include <cstring>

#include "isp/raw/kernel/raw_to_rgb_rows.h"

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/raw/kernel/raw_to_rgb_convert.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "isp/raw/kernel/raw_to_rgb_demosaic-inl.h"
#include "isp/raw/kernel/raw_to_rgb_look-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Ints = hn::RebindToSigned<Floats>;
using VI = hn::Vec<Ints>;

/// Holds the constants of the steps after demosaicing: clip, matrix, gamut mapping.
struct ColourVectors {
  VF column[3][3];
  VF luminance[3];
  VF clip;

  explicit HWY_INLINE ColourVectors(const Colour& from) {
    for (int c = 0; c < 3; ++c) {
      for (int j = 0; j < 3; ++j) column[c][j] = constant(from.column[c][j]);
      luminance[c] = constant(from.luminance[c]);
    }
    clip = constant(from.clip);
  }

  HWY_INLINE Site transform(const Site& in) const {
    const VF c0 = hn::Min(in.c[0], clip), c1 = hn::Min(in.c[1], clip), c2 = hn::Min(in.c[2], clip);
    const auto output = [&](int j) HWY_ATTR {
      return hn::MulAdd(column[2][j], c2, hn::MulAdd(column[1][j], c1, hn::Mul(column[0][j], c0)));
    };
    return {{output(0), output(1), output(2)}};
  }

  /// Returns colours below black as Y + t (v - Y) with t = Y / (Y - min(v)). t is taken 2^-22 short, so that no
  /// rounding can leave 0..1; colours inside keep every bit, as 0 + 1 (v - 0).
  HWY_INLINE Site above_black(const Site& v, VF least) const {
    const VF weighted =
        hn::MulAdd(luminance[2], v.c[2], hn::MulAdd(luminance[1], v.c[1], hn::Mul(luminance[0], v.c[0])));
    const VF y = hn::Max(weighted, constant(0));
    const auto outside = hn::Lt(least, constant(0));
    // The end lies 1e-30 below 0, so that no distance is 0.
    const VF distance = hn::Sub(y, hn::Min(least, constant(-1e-30f)));
    const VF t = hn::IfThenElse(outside, hn::Div(hn::Mul(y, constant(1 - 0x1p-22f)), distance), constant(1));
    return scaled(v, hn::IfThenElseZero(outside, y), t);
  }

  /// Returns colours that reach beyond white as m + s (v - m) with m = min(v, 1), s = (1 - m) / (max(v) - m), likewise.
  static HWY_INLINE Site below_white(const Site& v) {
    const VF one = constant(1), high = greatest(v), low = hn::Min(least(v), one);
    const auto outside = hn::Gt(high, one);
    const VF distance = hn::Sub(hn::Max(high, constant(1 + 0x1p-23f)), low);
    const VF s = hn::IfThenElse(outside, hn::Div(hn::Mul(hn::Sub(one, low), constant(1 - 0x1p-22f)), distance), one);
    return scaled(v, hn::IfThenElseZero(outside, low), s);
  }

  HWY_INLINE void move_into_gamut(SitePair& v) const {
    const VF min_even = least(v.even), min_odd = least(v.odd);
    if (!hn::AllFalse(Floats(), hn::Lt(hn::Min(min_even, min_odd), constant(0)))) {
      v.even = above_black(v.even, min_even);
      v.odd = above_black(v.odd, min_odd);
    }
    if (!hn::AllFalse(Floats(), hn::Gt(hn::Max(greatest(v.even), greatest(v.odd)), constant(1)))) {
      v.even = below_white(v.even);
      v.odd = below_white(v.odd);
    }
  }

 private:
  static HWY_INLINE VF least(const Site& s) { return hn::Min(hn::Min(s.c[0], s.c[1]), s.c[2]); }
  static HWY_INLINE VF greatest(const Site& s) { return hn::Max(hn::Max(s.c[0], s.c[1]), s.c[2]); }

  /// Returns from + factor (v - from).
  static HWY_INLINE Site scaled(const Site& v, VF from, VF factor) {
    return {{hn::MulAdd(factor, hn::Sub(v.c[0], from), from), hn::MulAdd(factor, hn::Sub(v.c[1], from), from),
             hn::MulAdd(factor, hn::Sub(v.c[2], from), from)}};
  }
};

HWY_INLINE void clamp(Site& v) {
  for (VF& c : v.c) c = hn::Min(hn::Max(c, constant(0)), constant(1));
}

/// Looks up bins of a ToneTable and the position within the bin.
struct Tone {
  VF offset;
  VI base;
  VI bin_mask;
  VF bin_fraction;
  int shift;
  const ToneTable* table;

  explicit HWY_INLINE Tone(const ToneTable& tone)
      : offset(constant(tone.offset)),
        base(hn::Set(Ints(), static_cast<std::int32_t>(tone.base_bits()))),
        bin_mask(hn::Set(Ints(), (1 << tone.shift) - 1)),
        bin_fraction(constant(1.0f / static_cast<float>(1 << tone.shift))),
        shift(tone.shift),
        table(&tone) {}

  HWY_INLINE VI steps(VF v) const { return hn::Sub(hn::BitCast(Ints(), hn::Add(v, offset)), base); }
  HWY_INLINE VI code8(VF v) const {
    return hn::GatherIndex(Ints(), table->code8.data(), hn::ShiftRightSame(steps(v), shift));
  }
  HWY_INLINE VI code16(VF v) const {
    const Floats f;
    const VI step = steps(v), bin = hn::ShiftRightSame(step, shift);
    const VF low = hn::GatherIndex(f, table->edge.data(), bin), high = hn::GatherIndex(f, table->edge.data() + 1, bin);
    const VF fraction = hn::Mul(hn::ConvertTo(f, hn::And(step, bin_mask)), bin_fraction);
    return hn::NearestInt(hn::Mul(constant(65535.0f), hn::MulAdd(fraction, hn::Sub(high, low), low)));
  }
};

constexpr int pixels_at_once() { return 2 * static_cast<int>(hn::MaxLanes(Floats())); }

// The classes below store finished pixels: write() stores a vector of pairs at x of a row with `left` pixels from x.

struct ToCodes8 {
  static constexpr bool clamps = true;
  Tone tone;
  std::uint8_t* out;
  int pixel_bytes;
  bool is_bgr;

  explicit HWY_INLINE ToCodes8(const Codes8& to)
      : tone(*to.tone), out(to.out), pixel_bytes(to.pixel_bytes), is_bgr(to.is_bgr) {}

  HWY_INLINE auto codes(VF even, VF odd) const {
    const hn::Rebind<std::uint16_t, Floats> u16;
    const hn::Repartition<std::uint8_t, decltype(u16)> u8;
    const VI pair = hn::Or(tone.code8(even), hn::ShiftLeft<8>(tone.code8(odd)));
    return hn::BitCast(u8, hn::TruncateTo(u16, hn::BitCast(hn::RebindToUnsigned<Ints>(), pair)));
  }
  HWY_INLINE void write(const SitePair& v, int x, int left) const {
    const hn::Repartition<std::uint8_t, hn::Rebind<std::uint16_t, Floats>> u8;
    HWY_ALIGN std::uint8_t last[4 * pixels_at_once()];
    const auto r = codes(v.even.c[0], v.odd.c[0]);
    const auto g = codes(v.even.c[1], v.odd.c[1]);
    const auto b = codes(v.even.c[2], v.odd.c[2]);
    const bool whole = left >= pixels_at_once();
    std::uint8_t* const row = out + pixel_bytes * static_cast<std::ptrdiff_t>(x);
    std::uint8_t* const to = whole ? row : last;
    if (pixel_bytes == 4) {
      const auto full = hn::Set(u8, 255);
      is_bgr ? hn::StoreInterleaved4(b, g, r, full, u8, to) : hn::StoreInterleaved4(r, g, b, full, u8, to);
    } else {
      is_bgr ? hn::StoreInterleaved3(b, g, r, u8, to) : hn::StoreInterleaved3(r, g, b, u8, to);
    }
    if (!whole) std::memcpy(row, last, static_cast<std::size_t>(pixel_bytes) * static_cast<std::size_t>(left));
  }
};

struct ToCodes16 {
  static constexpr bool clamps = true;
  Tone tone;
  std::uint16_t* out;

  explicit HWY_INLINE ToCodes16(const Codes16& to) : tone(*to.tone), out(to.out) {}

  HWY_INLINE auto codes(VF even, VF odd) const {
    const hn::Repartition<std::uint16_t, Floats> u16;
    return hn::BitCast(u16, hn::Or(tone.code16(even), hn::ShiftLeft<16>(tone.code16(odd))));
  }
  HWY_INLINE void write(const SitePair& v, int x, int left) const {
    const hn::Repartition<std::uint16_t, Floats> u16;
    HWY_ALIGN std::uint16_t last[3 * pixels_at_once()];
    const auto r = codes(v.even.c[0], v.odd.c[0]);
    const auto g = codes(v.even.c[1], v.odd.c[1]);
    const auto b = codes(v.even.c[2], v.odd.c[2]);
    std::uint16_t* to = out + 3 * static_cast<std::ptrdiff_t>(x);
    hn::StoreInterleaved3(r, g, b, u16, left < pixels_at_once() ? last : to);
    if (left < pixels_at_once()) std::memcpy(to, last, 3 * static_cast<std::size_t>(left) * sizeof *to);
  }
};

struct ToPlanes {
  static constexpr bool clamps = false;
  float* out[3];

  explicit HWY_INLINE ToPlanes(const Planes& to) : out{to.out[0], to.out[1], to.out[2]} {}

  HWY_INLINE void write(const SitePair& v, int x, int left) const {
    HWY_ALIGN float last[pixels_at_once()];
    for (int c = 0; c < 3; ++c) {
      float* to = out[c] + x;
      hn::StoreInterleaved2(v.even.c[c], v.odd.c[c], Floats(), left < pixels_at_once() ? last : to);
      if (left < pixels_at_once()) std::memcpy(to, last, static_cast<std::size_t>(left) * sizeof *to);
    }
  }
};

template <class Source, class Look, class Sink>
HWY_INLINE void convert(const Source& source, const Colour& colour, const Look& look, int width, const Sink& sink) {
  const ColourVectors vectors(colour);
  const bool move = colour.move_into_gamut;
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  for (int i = 0; 2 * i < width; i += lanes) {
    SitePair v = source.at(i);
    v = {vectors.transform(v.even), vectors.transform(v.odd)};
    look(v, i);
    if (move) {
      vectors.move_into_gamut(v);
    } else if (Sink::clamps) {
      clamp(v.even);
      clamp(v.odd);
    }
    sink.write(v, 2 * i, width - 2 * i);
  }
}

template <class Source, class Sink>
HWY_INLINE void convert(const Source& source, const Colour& colour, int width, const Sink& sink) {
  if (colour.look != nullptr) {
    convert(source, colour, LookVectors(*colour.look), width, sink);
  } else {
    convert(source, colour, AsItIs(), width, sink);
  }
}

template <class Sink>
HWY_INLINE void convert_mosaic(const MosaicRows& in, const Colour& colour, int width, const Sink& sink) {
  if (in.encoded && in.own_is_odd) {
    convert(EncodedMalvar<true>(in), colour, width, sink);
  } else if (in.encoded) {
    convert(EncodedMalvar<false>(in), colour, width, sink);
  } else if (in.own_is_odd) {
    convert(Malvar<true>(in), colour, width, sink);
  } else {
    convert(Malvar<false>(in), colour, width, sink);
  }
}

void MosaicTo8(const MosaicRows& in, const Colour& colour, int width, const Codes8& out) {
  convert_mosaic(in, colour, width, ToCodes8(out));
}
void MosaicTo16(const MosaicRows& in, const Colour& colour, int width, const Codes16& out) {
  convert_mosaic(in, colour, width, ToCodes16(out));
}
void MosaicToPlanes(const MosaicRows& in, const Colour& colour, int width, const Planes& out) {
  convert_mosaic(in, colour, width, ToPlanes(out));
}
void PlanesTo8(const PlaneRows& in, const Colour& colour, int width, const Codes8& out) {
  convert(Demosaiced{in}, colour, width, ToCodes8(out));
}
void PlanesTo16(const PlaneRows& in, const Colour& colour, int width, const Codes16& out) {
  convert(Demosaiced{in}, colour, width, ToCodes16(out));
}
void PlanesToPlanes(const PlaneRows& in, const Colour& colour, int width, const Planes& out) {
  convert(Demosaiced{in}, colour, width, ToPlanes(out));
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::rows {

HWY_EXPORT(MosaicTo8);
HWY_EXPORT(MosaicTo16);
HWY_EXPORT(MosaicToPlanes);
HWY_EXPORT(PlanesTo8);
HWY_EXPORT(PlanesTo16);
HWY_EXPORT(PlanesToPlanes);
HWY_EXPORT(TargetName);

void convert_row(const MosaicRows& in, const Colour& colour, int width, const Codes8& out) {
  HWY_DYNAMIC_DISPATCH(MosaicTo8)(in, colour, width, out);
}
void convert_row(const MosaicRows& in, const Colour& colour, int width, const Codes16& out) {
  HWY_DYNAMIC_DISPATCH(MosaicTo16)(in, colour, width, out);
}
void convert_row(const MosaicRows& in, const Colour& colour, int width, const Planes& out) {
  HWY_DYNAMIC_DISPATCH(MosaicToPlanes)(in, colour, width, out);
}
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Codes8& out) {
  HWY_DYNAMIC_DISPATCH(PlanesTo8)(in, colour, width, out);
}
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Codes16& out) {
  HWY_DYNAMIC_DISPATCH(PlanesTo16)(in, colour, width, out);
}
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Planes& out) {
  HWY_DYNAMIC_DISPATCH(PlanesToPlanes)(in, colour, width, out);
}

const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace lowlux::isp::rows
#endif
