#pragma once

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {

/// Makes linear values of the output space, exposure included, and applies the profile's tables to them.
/// @param planes  of the size of the image of `in`; they are set, and the result refers to them
/// Precondition: plan.rendering.profile.
CameraPlanes through_profile(RawToRgb& kernel, const RgbInput& in, const DevelopPlan& plan,
                             const RgbView<float>& planes, Executor& executor);

/// Returns the remaining transform of planes that are already light in the image's primaries.
RgbTransform transform_of_modelled(const DevelopPlan& plan, const LookGrid* look);

}  // namespace lowlux::isp
