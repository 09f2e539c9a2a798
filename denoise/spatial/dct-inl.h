// Eight-point DCT of kernels, included once for each instruction set: hence a guard that toggles instead of #pragma
// once.
#if defined(LOWLUX_DENOISE_DCT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_DENOISE_DCT_INL_H
#undef LOWLUX_DENOISE_DCT_INL_H
#else
#define LOWLUX_DENOISE_DCT_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(VF v, float* to) { hn::StoreU(v, Floats(), to); }
HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }

// cos(k pi / 16) / 2 for k = 1, 2, 3, 5, 6, 7, and 1 / sqrt(8)
constexpr float c1 = 0.490392640202f, c2 = 0.461939766256f, c3 = 0.415734806151f, c5 = 0.277785116510f;
constexpr float c6 = 0.191341716183f, c7 = 0.0975451610081f, c0 = 0.353553390593f;

constexpr float per_root2 = 0.707106781187f;

/// Returns a x + b y + c z + d w.
HWY_INLINE VF dot4(float a, VF x, float b, VF y, float c, VF z, float d, VF w) {
  return hn::MulAdd(constant(a), x, hn::MulAdd(constant(b), y, hn::MulAdd(constant(c), z, hn::Mul(constant(d), w))));
}

/// Computes the orthonormal DCT-II in place, independently in each lane: even and odd halves, 36 operations.
HWY_INLINE void forward8(VF (&x)[8]) {
  const VF a0 = hn::Add(x[0], x[7]), a1 = hn::Add(x[1], x[6]), a2 = hn::Add(x[2], x[5]), a3 = hn::Add(x[3], x[4]);
  const VF b0 = hn::Sub(x[0], x[7]), b1 = hn::Sub(x[1], x[6]), b2 = hn::Sub(x[2], x[5]), b3 = hn::Sub(x[3], x[4]);
  const VF s0 = hn::Add(a0, a3), s1 = hn::Add(a1, a2), d0 = hn::Sub(a0, a3), d1 = hn::Sub(a1, a2);
  x[0] = hn::Mul(constant(c0), hn::Add(s0, s1));
  x[4] = hn::Mul(constant(c0), hn::Sub(s0, s1));
  x[2] = hn::MulAdd(constant(c2), d0, hn::Mul(constant(c6), d1));
  x[6] = hn::MulAdd(constant(c6), d0, hn::Mul(constant(-c2), d1));
  x[1] = dot4(c1, b0, c3, b1, c5, b2, c7, b3);
  x[3] = dot4(c3, b0, -c7, b1, -c1, b2, -c5, b3);
  x[5] = dot4(c5, b0, -c1, b1, c7, b2, c3, b3);
  x[7] = dot4(c7, b0, -c5, b1, c3, b2, -c1, b3);
}

/// Computes the inverse of forward8() in place, which is its transpose.
HWY_INLINE void inverse8(VF (&x)[8]) {
  const VF e0 = hn::Mul(constant(c0), hn::Add(x[0], x[4])), e1 = hn::Mul(constant(c0), hn::Sub(x[0], x[4]));
  const VF f0 = hn::MulAdd(constant(c2), x[2], hn::Mul(constant(c6), x[6]));
  const VF f1 = hn::MulAdd(constant(c6), x[2], hn::Mul(constant(-c2), x[6]));
  const VF a0 = hn::Add(e0, f0), a1 = hn::Add(e1, f1), a2 = hn::Sub(e1, f1), a3 = hn::Sub(e0, f0);
  const VF o0 = dot4(c1, x[1], c3, x[3], c5, x[5], c7, x[7]), o1 = dot4(c3, x[1], -c7, x[3], -c1, x[5], -c5, x[7]);
  const VF o2 = dot4(c5, x[1], -c1, x[3], c7, x[5], c3, x[7]), o3 = dot4(c7, x[1], -c5, x[3], c3, x[5], -c1, x[7]);
  x[0] = hn::Add(a0, o0);
  x[1] = hn::Add(a1, o1);
  x[2] = hn::Add(a2, o2);
  x[3] = hn::Add(a3, o3);
  x[4] = hn::Sub(a3, o3);
  x[5] = hn::Sub(a2, o2);
  x[6] = hn::Sub(a1, o1);
  x[7] = hn::Sub(a0, o0);
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
