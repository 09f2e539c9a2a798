// This is the demosaicing half of raw_to_rgb_convert.cpp, which includes it once for each instruction set: hence a
// guard that toggles in place of #pragma once.
#if defined(LOWLUX_ISP_RAW_RAW_TO_RGB_DEMOSAIC_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_ISP_RAW_RAW_TO_RGB_DEMOSAIC_INL_H
#undef LOWLUX_ISP_RAW_RAW_TO_RGB_DEMOSAIC_INL_H
#else
#define LOWLUX_ISP_RAW_RAW_TO_RGB_DEMOSAIC_INL_H
#endif

#include <hwy/highway.h>

#include "isp/raw/kernel/encoding-inl.h"
#include "isp/raw/kernel/raw_to_rgb_rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }

/// Three channels of one vector of sites, which are all in even or all in odd columns.
struct Site {
  VF c[3];
};
struct SitePair {
  Site even;
  Site odd;
};

/// Implements Malvar, He, Cutler: "High-quality linear interpolation for demosaicing of Bayer-patterned color images",
/// ICASSP 2004, figure 2, coefficients / 8. `a` is the run of the row's own colour, `b` the run of its greens.
template <bool kOwnOdd>
struct Malvar {
  const float* a[5];
  const float* b[5];

  explicit HWY_INLINE Malvar(const MosaicRows& in) {
    for (int k = 0; k < 5; ++k) {
      a[k] = kOwnOdd ? in.odd[k] : in.even[k];
      b[k] = kOwnOdd ? in.even[k] : in.odd[k];
    }
  }

  HWY_INLINE SitePair at(int i) const {
    constexpr int s = kOwnOdd ? 1 : 0;  // offset of a run's neighbour to the right
    const VF own = load(a[2] + i), green = load(b[2] + i);
    // These are sums of the rows above and below; those of the site itself are also half of the other site's diagonals.
    const VF b_left = hn::Add(load(b[1] + i - 1 + s), load(b[3] + i - 1 + s));
    const VF b_right = hn::Add(load(b[1] + i + s), load(b[3] + i + s));
    const VF a_left = hn::Add(load(a[1] + i - s), load(a[3] + i - s));
    const VF a_right = hn::Add(load(a[1] + i + 1 - s), load(a[3] + i + 1 - s));
    const VF a_vertical = kOwnOdd ? a_right : a_left;
    const VF b_vertical = kOwnOdd ? b_left : b_right;

    // At the row's own colour: cross of greens, diagonals of the other colour, distant cross of the own colour.
    const VF cross = hn::Add(a_vertical, hn::Add(load(b[2] + i - 1 + s), load(b[2] + i + s)));
    const VF far_cross =
        hn::Add(hn::Add(load(a[0] + i), load(a[4] + i)), hn::Add(load(a[2] + i - 1), load(a[2] + i + 1)));
    const VF diagonal = hn::Add(b_left, b_right);
    const VF shared = hn::MulAdd(constant(-0.125f), far_cross, hn::Mul(constant(0.5f), own));
    const Site at_own{{own, hn::MulAdd(constant(0.25f), cross, shared),
                       hn::MulAdd(constant(1.5f), shared, hn::Mul(constant(0.25f), diagonal))}};

    // At green: own colour left and right, other colour above and below, greens on the diagonals and two away.
    const VF far_vertical = hn::Add(load(b[0] + i), load(b[4] + i));
    const VF far_horizontal = hn::Add(load(b[2] + i - 1), load(b[2] + i + 1));
    const VF base = hn::MulAdd(constant(0.625f), green, hn::Mul(constant(-0.125f), hn::Add(a_left, a_right)));
    const VF horizontal = hn::Add(load(a[2] + i - s), load(a[2] + i + 1 - s));
    const Site at_green{
        {hn::MulAdd(constant(0.5f), horizontal,
                    hn::MulAdd(constant(-0.125f), far_horizontal, hn::MulAdd(constant(0.0625f), far_vertical, base))),
         green,
         hn::MulAdd(constant(0.5f), b_vertical,
                    hn::MulAdd(constant(-0.125f), far_vertical, hn::MulAdd(constant(0.0625f), far_horizontal, base)))}};
    return kOwnOdd ? SitePair{at_green, at_own} : SitePair{at_own, at_green};
  }
};

/// Applies the same filters to encoded values and decodes what they interpolate.
template <bool kOwnOdd>
struct EncodedMalvar {
  Malvar<kOwnOdd> filters;
  EncodingVectors code;
  const float* linear_even;
  const float* linear_odd;

  explicit HWY_INLINE EncodedMalvar(const MosaicRows& in)
      : filters(in), code(in.encoding), linear_even(in.linear_even), linear_odd(in.linear_odd) {}

  HWY_INLINE SitePair at(int i) const {
    const SitePair u = filters.at(i);
    const VF even = load(linear_even + i), odd = load(linear_odd + i);
    constexpr int own = kOwnOdd ? 1 : 0, green = 1 - own;  // the channel measured at even and at odd columns
    const auto decoded = [this](const Site& site, VF measured, int channel) HWY_ATTR {
      const auto value = [&](int c) HWY_ATTR { return c == channel ? measured : code.decode(site.c[c]); };
      return Site{{value(0), value(1), value(2)}};
    };
    return {decoded(u.even, even, own), decoded(u.odd, odd, green)};
  }
};

struct Demosaiced {
  PlaneRows in;
  HWY_INLINE SitePair at(int i) const {
    return {{{load(in.even[0] + i), load(in.even[1] + i), load(in.even[2] + i)}},
            {{load(in.odd[0] + i), load(in.odd[1] + i), load(in.odd[2] + i)}}};
  }
};

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
