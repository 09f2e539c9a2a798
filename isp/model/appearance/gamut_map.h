#pragma once

#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// Holds linear RGB in a gamut of 0..1, and the fraction of its chroma that was kept.
struct GamutMapped {
  Vector3 rgb{};
  double kept = 1;  // t: 1 for a colour inside the gamut, 0 for one that became grey
};

/// Moves a colour towards the grey of its luminance until it is within 0..1: Y (1, 1, 1) + t (rgb - Y (1, 1, 1)) with
/// the largest t in 0..1. Luminance and direction of chroma are kept. A luminance of 0 or less gives
/// black, one of 1 or more white, the only colours of that luminance or nearest to it. Pictures for other displays are
/// mapped so, as luminance is what their models predict; photographs keep their colour instead (`RgbTransform`).
/// @param luminance_weights  weights of R, G and B; they sum to 1
GamutMapped toward_white(const Vector3& rgb, const Vector3& luminance_weights);

}  // namespace lowlux::isp
