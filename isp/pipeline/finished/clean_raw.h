#pragma once

#include <cstddef>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// Holds a raw frame without noise, for any raw developer.
struct CleanRaw {
  RawFrame frame;  // the active area only, in 16-bit codes, or floating-point if the frame was
  DevelopPlan plan;
  NoiseMaps maps;  // maps of the active area; empty unless requested
};

/// Reduces the noise of a frame, repairs its defects, and encodes it again in 16 bits; a frame of floating-point
/// samples remains one. Mosaics, monochrome frames and images of three colours (SensorLayout::linear_rgb, X-Trans
/// included) stay what they are. Lines and dark charge are subtracted from mosaics; other frames have none that are
/// known (see plan_pixel_noise). Their maps have a value for each pixel (scale_to_pixels).
///
/// Samples are those of encode_signal. Corrections that the source requests for linear values (gain maps) are still
/// requested; defects, masked pixels and dark charge are gone. The NoiseProfile is that of residual_profile.
///
/// Errors: those of plan_develop; noise that cannot be reduced at all (the plan's reason), also for an automatic level.
Result<CleanRaw> clean_raw(const RawFrame& frame, const DevelopOptions& options, Executor& executor);

/// Returns about the maximum of the memory for clean_raw, with the frame itself and the clean one: see expected_bytes.
std::size_t clean_raw_bytes(const RawDn& raw, const DevelopOptions& options, int threads);

}  // namespace lowlux::isp
