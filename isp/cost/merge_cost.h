#pragma once

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cost/speed_probe.h"
#include "isp/pipeline/budget/cost_model.h"

namespace lowlux::isp {

/// Measures the costs of the parts of merging on this machine and adds them to a model: frames of 0.01 to 9 MP
/// that differ in their noise, merged as isp::merge_frames does it, medians of three passes, each relative to the fixed
/// workload of `pace`.
/// @param pace_s  usual time of that workload
/// Errors: those of merge_frames.
Result<void> measure_merge_cost(SpeedProbe& pace, double pace_s, Executor& executor, CostModel& model);

}  // namespace lowlux::isp
