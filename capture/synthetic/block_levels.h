#pragma once

#include <vector>

#include "capture/synthetic/sensor_sim.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::capture {

/// Returns the levels of each block at the sensor, row by row, for the planner. A block without a pixel of a channel
/// (frames one pixel wide) has the mean of the others there.
std::vector<isp::BlockLevel> block_levels(const SensorFrame& frame);

}  // namespace lowlux::capture
