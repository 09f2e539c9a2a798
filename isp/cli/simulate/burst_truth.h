#pragma once

#include <string>
#include <vector>

#include "capture/synthetic/burst.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Returns the truth of a burst as JSON: size, options and, for each frame, its file, exposure time, motions and boxes
/// of moving objects; then the points of frame 0. Positions are in pixels, integers at their centres; motions are those
/// from frame 0 to the frame: what is at p is at centre + R (p - centre) + (dx, dy), R turning clockwise.
/// @param files of the frames
std::string burst_truth_json(const SimulateArgs& args, const capture::BurstSource& source,
                             const std::vector<std::string>& files);

}  // namespace lowlux::cli
