#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"

namespace lowlux::isp {

/// Measures the neutral that WhiteBalanceChoice::picked names: the mean camera RGB of the light in a square of the
/// frame, black level and dark charge subtracted, gain maps and lens shading applied. Its largest component is 1.
/// @param measured  the frame, a dark frame subtracted if there is one
/// @param levels    with the defects that are repaired: they are left out of the mean
/// Error: invalid_argument, where the square lies outside the image, where more than a hundredth of it is saturated, or
/// where the mean of a channel is below five standard errors; and for monochrome frames.
Result<Vector3> picked_neutral(const RawFrame& measured, const RawLevels& levels, const DevelopOptions& options,
                               Executor& executor);

}  // namespace lowlux::isp
