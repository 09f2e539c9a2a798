// Stabilised values of kernels, see stabiliser.h. Included once for each instruction set: hence a guard that toggles
// instead of #pragma once.
#if defined(LOWLUX_DENOISE_STABILISER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_DENOISE_STABILISER_INL_H
#undef LOWLUX_DENOISE_STABILISER_INL_H
#else
#define LOWLUX_DENOISE_STABILISER_INL_H
#endif

#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"
#include "denoise/spatial/rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

/// Returns h of light, which is given as a fraction of the offset.
HWY_INLINE VF stabilised(VF light) {
  const VF root = hn::Max(light, constant(linear_light));
  const VF curved = hn::Div(hn::Add(root, root), hn::Add(constant(1), hn::Sqrt(hn::Add(constant(1), root))));
  return hn::MulAdd(constant(1 / linear_slope), hn::Sub(light, root), curved);
}

/// Returns the light of a stabilised value, both as fractions of the offset.
HWY_INLINE VF light_of(VF value) {
  const VF root = hn::Max(value, constant(linear_value));
  const VF curved = hn::MulAdd(hn::Mul(constant(0.25f), root), root, root);
  return hn::MulAdd(constant(linear_slope), hn::Sub(value, root), curved);
}

/// Returns the slope of the light of a stabilised value, which is given as a fraction of the offset.
HWY_INLINE VF slope_of_light(VF value) {
  return hn::MulAdd(constant(0.5f), hn::Max(value, constant(linear_value)), constant(1));
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
