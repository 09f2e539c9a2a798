#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Holds a developed frame and the plan it was made with. The image is not yet turned upright: FrameInfo::orientation
/// states its orientation.
struct Developed {
  Picture picture;
  DevelopPlan plan;
  NoiseMaps noise_maps;     // maps of the active area; empty unless its noise was reduced and maps were requested
  Plane<float> seeing_map;  // probability of seeing, one value for 4 x 4 pixels of the image; empty unless requested
};

/// Develops one frame from raw to image: plan_develop, then Pipeline::render.
Result<Developed> develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor);

}  // namespace lowlux::isp
