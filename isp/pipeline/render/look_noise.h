#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Variance of the noise in the luminance of the picture's pixels, in their unit (that of plan.rendering.transform),
/// one figure for each cell of 4 x 4: what the denoiser says it left, or what the noise model says of what came in.
/// Needs noise that was reduced, or a look that knows it.
/// @param maps  of the active area; read where noise was reduced
/// @param quarter  means of camera RGB (RawToRgb::quarter), read where it was not
/// @param out  ceil(plan.height / 4) x ceil(plan.width / 4)
void noise_of_luminance(const DevelopPlan& plan, const Rect& crop, const NoiseMaps& maps,
                        const RgbView<const float>& quarter, PlaneView<float> out, Executor& executor);

}  // namespace lowlux::isp
