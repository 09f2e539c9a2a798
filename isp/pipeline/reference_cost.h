#pragma once

#include <string_view>

#include "isp/pipeline/cost_model.h"

namespace lowlux::isp {

inline constexpr std::string_view reference_machine = "two cores of an AMD EPYC with AVX-512";

/// The times of large frames on the reference machine, measured by `lowlux bench --calibrate-cost` when nothing else
/// ran on it. In units of its pace they are an estimate for a machine that was not measured: parts limited by memory
/// and parts limited by arithmetic do not scale alike from one processor to another.
const CostModel& reference_cost();

}  // namespace lowlux::isp
