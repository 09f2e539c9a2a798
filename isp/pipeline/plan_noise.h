#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/thumbnail.h"

namespace lowlux::isp {

/// Decides how noise is reduced. What contradicts the noise model becomes a warning of the plan.
/// @param plan  with black, defects, electrons at white and white gains decided
/// Errors, for a level that was asked for: a frame that is no Bayer mosaic (unsupported), unknown noise (insufficient).
/// For an automatic one these are reasons to leave the noise.
Result<NoiseReduction> plan_noise(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan,
                                  Executor& executor);

}  // namespace lowlux::isp
