#pragma once

#include <cstdint>

#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/sensor.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Lists the bits of a mask.
inline constexpr unsigned char mask_saturated = 1;  // the code is at the file's white level, or above it
inline constexpr unsigned char mask_hot = 2;        // the pixel is a hot pixel of the sensor's specimen
inline constexpr unsigned char mask_shielded = 4;   // the pixel is in a light-shielded column

/// Returns the mask of a simulated frame: one byte for each pixel of the readout.
Plane<std::uint8_t> mask_of(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor);

}  // namespace lowlux::cli
