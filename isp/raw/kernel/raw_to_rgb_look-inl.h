// This is the look in raw_to_rgb_convert.cpp, which includes it once for each instruction set: hence a guard that
// toggles in place of #pragma once.
#if defined(LOWLUX_ISP_RAW_RAW_TO_RGB_LOOK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_ISP_RAW_RAW_TO_RGB_LOOK_INL_H
#undef LOWLUX_ISP_RAW_RAW_TO_RGB_LOOK_INL_H
#else
#define LOWLUX_ISP_RAW_RAW_TO_RGB_LOOK_INL_H
#endif

#include <cstdint>

#include <hwy/highway.h>

#include "isp/raw/kernel/raw_to_rgb_demosaic-inl.h"
#include "isp/raw/kernel/raw_to_rgb_rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using LaneIndices = decltype(hn::SetTableIndices(Floats(), static_cast<const std::int32_t*>(nullptr)));

/// Applies no look: pixels stay as they are.
struct AsItIs {
  HWY_INLINE void operator()(SitePair& /*pixels*/, int /*i*/) const {}
};

/// Applies a LookGrid to a vector of pairs. Relative to the cells' centres, pixel pair i lies between cells j - 1 and
/// j, j = i / 2: 5/8 and 7/8 of the way for even i, and 1/8 and 3/8 of the way between the next two for odd i.
struct LookVectors {
  LookRow row;
  LaneIndices before, after;
  VF even_way, odd_way;
  VF luminance[3], rods[3], tint[3];
  VF dark;

  explicit HWY_INLINE LookVectors(const LookRow& from) : row(from) {
    const Floats f;
    HWY_ALIGN std::int32_t low[hn::MaxLanes(Floats())], high[hn::MaxLanes(Floats())];
    HWY_ALIGN float even[hn::MaxLanes(Floats())], odd[hn::MaxLanes(Floats())];
    for (std::size_t k = 0; k < hn::Lanes(f); ++k) {
      low[k] = static_cast<std::int32_t>((k + 1) / 2);
      high[k] = low[k] + 1;
      even[k] = (k & 1) != 0 ? 0.125f : 0.625f;
      odd[k] = even[k] + 0.25f;
    }
    before = hn::SetTableIndices(f, low);
    after = hn::SetTableIndices(f, high);
    even_way = hn::Load(f, even);
    odd_way = hn::Load(f, odd);
    for (int c = 0; c < 3; ++c) {
      luminance[c] = constant(from.luminance[c]);
      rods[c] = constant(from.rods[c]);
      tint[c] = constant(from.tint[c]);
    }
    dark = constant(from.dark);
  }

  /// Returns the parts at the even and at the odd pixels of pairs from i. They are not held in a struct, whose
  /// constructor would be compiled for another target.
  HWY_INLINE void parts_at(int i, VF (&even)[LookGrid::parts], VF (&odd)[LookGrid::parts]) const {
    for (int k = 0; k < LookGrid::parts; ++k) {
      const VF cells = load(row.part[k] + i / 2 - 1);
      const VF a = hn::TableLookupLanes(cells, before);
      const VF step = hn::Sub(hn::TableLookupLanes(cells, after), a);
      even[k] = hn::MulAdd(even_way, step, a);
      odd[k] = hn::MulAdd(odd_way, step, a);
    }
  }

  static HWY_INLINE VF weighted(const VF (&weight)[3], const Site& v) {
    return hn::MulAdd(weight[2], v.c[2], hn::MulAdd(weight[1], v.c[1], hn::Mul(weight[0], v.c[0])));
  }

  HWY_INLINE Site seen(const Site& v, const VF (&part)[LookGrid::parts]) const {
    const VF zero = constant(0), one = constant(1);
    const VF y = weighted(luminance, v);
    const VF s = hn::Max(weighted(rods, v), hn::Min(hn::Mul(constant(LookGrid::min_rods), y), y));
    const VF e = hn::MulAdd(part[LookGrid::rod_fraction], hn::Sub(s, y), y);
    const VF chroma =
        hn::Div(hn::Mul(part[LookGrid::chroma], hn::Add(hn::Max(e, zero), dark)), hn::Add(hn::Max(y, zero), dark));
    const VF light = hn::MulAdd(part[LookGrid::detail], e, part[LookGrid::base]);
    const auto channel = [&](int c) HWY_ATTR {
      const VF tinted = hn::MulAdd(part[LookGrid::blue], tint[c], one);
      return hn::MulAdd(light, tinted, hn::Mul(chroma, hn::Sub(v.c[c], y)));
    };
    return {{channel(0), channel(1), channel(2)}};
  }

  HWY_INLINE void operator()(SitePair& v, int i) const {
    VF even[LookGrid::parts], odd[LookGrid::parts];
    parts_at(i, even, odd);
    v = {seen(v.even, even), seen(v.odd, odd)};
  }
};

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
