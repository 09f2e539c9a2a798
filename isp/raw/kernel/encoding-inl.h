// This is the encoding of values for demosaicing, as included once for each instruction set by the kernel sources:
// hence a guard that toggles in place of #pragma once.
#if defined(LOWLUX_ISP_RAW_ENCODING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_ISP_RAW_ENCODING_INL_H
#undef LOWLUX_ISP_RAW_ENCODING_INL_H
#else
#define LOWLUX_ISP_RAW_ENCODING_INL_H
#endif

#include <hwy/highway.h>

#include "isp/raw/kernel/encoding.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {

/// Encodes and decodes vectors: u = cbrt(x + offset), continued below x = 0 by its tangent.
class EncodingVectors {
  using D = hwy::HWY_NAMESPACE::ScalableTag<float>;
  using V = hwy::HWY_NAMESPACE::Vec<D>;

 public:
  explicit HWY_INLINE EncodingVectors(const Encoding& from)
      : offset_(set(from.offset)), root_(cube_root(offset_)), slope_(set(from.slope)) {}

  /// Encodes values in encoding_min..encoding_max.
  HWY_INLINE V encode(V x) const {
    namespace hn = hwy::HWY_NAMESPACE;
    const V zero = hn::Zero(D());
    return hn::MulAdd(slope_, hn::Min(x, zero), cube_root(hn::Add(hn::Max(x, zero), offset_)));
  }

  /// Returns u^3 - r^3 = (u - r) (u^2 + r (u + r)) with r the code of 0, which decodes to 0 exactly. Below r, where the
  /// second factor is held, this is the tangent.
  HWY_INLINE V decode(V u) const {
    namespace hn = hwy::HWY_NAMESPACE;
    const V above = hn::Max(u, root_);
    return hn::Mul(hn::Sub(u, root_), hn::MulAdd(above, above, hn::Mul(root_, hn::Add(above, root_))));
  }

 private:
  static HWY_INLINE V set(float x) { return hwy::HWY_NAMESPACE::Set(D(), x); }

  /// Returns the cube root of x in 1e-7..1e10: an estimate of x^(-1/3) from the bits of x, within 5 %, then two steps
  /// of third order, after which rounding is what remains.
  static HWY_INLINE V cube_root(V x) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::RebindToSigned<D> ints;
    const V bits = hn::ConvertTo(D(), hn::BitCast(ints, x));
    V y = hn::BitCast(D(), hn::ConvertTo(ints, hn::NegMulAdd(bits, set(1.0f / 3), set(1419967116.0f))));
    for (int step = 0; step < 2; ++step) {
      const V e = hn::NegMulAdd(hn::Mul(x, y), hn::Mul(y, y), set(1));
      y = hn::MulAdd(hn::Mul(y, e), hn::MulAdd(e, set(2.0f / 9), set(1.0f / 3)), y);
    }
    return hn::Mul(x, hn::Mul(y, y));
  }

  V offset_, root_, slope_;
};

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
