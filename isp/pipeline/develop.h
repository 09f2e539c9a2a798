#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// A developed frame and how it was made. The picture is not yet turned upright: FrameInfo::orientation says how.
struct Developed {
  Picture picture;
  DevelopPlan plan;
  NoiseMaps noise_maps;  // of the active area; empty unless its noise was reduced and maps were asked for
};

/// One frame from raw to picture: plan_develop, then Pipeline::render.
Result<Developed> develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor);

}  // namespace lowlux::isp
