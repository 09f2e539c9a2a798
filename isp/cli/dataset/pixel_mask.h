#pragma once

#include <string>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Lists the bits of a mask.
inline constexpr unsigned char mask_saturated = 1;  // the code is at the file's white level, or above it
inline constexpr unsigned char mask_hot = 2;        // the pixel is a hot pixel of the sensor's specimen
inline constexpr unsigned char mask_shielded = 4;   // the pixel is in a light-shielded column

/// Writes the mask of a simulated frame as an array for NumPy (.npy, format 1.0): one byte for each pixel of the
/// readout, height x width. An existing file is replaced. Errors: those of AtomicFile; a full disk.
Result<void> write_mask(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor,
                        const std::string& file);

}  // namespace lowlux::cli
