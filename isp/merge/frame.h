#pragma once

#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::merge {

/// Borrows one frame of a merge: a Bayer mosaic in electrons of this frame's own exposure, pedestal and dark charge
/// subtracted, signed, nothing clipped. A site without a usable value (defective, saturated, outside of the frame) is
/// NaN. The variance of a value y of site s is Var[y] = max(E[y], 0) + variance_e2[s].
struct FrameView {
  PlaneView<const float> signal_e;
  BayerPhase phase = BayerPhase::rggb;
  PerSite<double> variance_e2{};  // of a pixel without light: read noise^2 + dark charge + quantisation step^2 / 12
};

}  // namespace lowlux::merge
