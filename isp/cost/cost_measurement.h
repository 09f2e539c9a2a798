#pragma once

#include <functional>
#include <string>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/pipeline/budget/cost_model.h"

namespace lowlux::isp {

/// Measures the costs of the parts of developing and merging on this machine, with as many threads as the executor has:
/// frames of 0.05 to 9 MP in three lights, so that chroma starts on each level, developed as isp::develop does it;
/// medians of five passes, each relative to a fixed workload, so that a moment in which the machine is busy changes
/// little. It takes about two minutes on two cores.
/// @param advance  called after each step with the fraction that is done with it, and its name
/// Errors: those of develop().
Result<CostModel> measure_cost(Executor& executor, const std::function<void(double, const std::string&)>& advance);

}  // namespace lowlux::isp
