#pragma once

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
  NoiseMaps maps;  // of the active area; empty unless requested
};

/// Subtracts lines and dark charge from a Bayer frame, reduces its noise, repairs its defects, and encodes it again in
/// 16 bits; a frame of floating-point samples remains one.
///
/// Samples are those of encode_signal. Corrections that the source requests for linear values (gain maps) are still
/// requested; defects, masked pixels and dark charge are gone. The NoiseProfile is that of residual_profile.
///
/// Errors: those of plan_develop; noise that cannot be reduced at all (the plan's reason), also for an automatic level.
Result<CleanRaw> clean_raw(const RawFrame& frame, const DevelopOptions& options, Executor& executor);

/// Returns the straight line variance = scale x + offset that is nearest, relative to the variances, to the residual
/// noise at each site; x and variances in fractions of white. Scales are at least what electrons_at_white accepts,
/// offsets at least 0.
/// @param signal_e         the clean mosaic
/// @param site_variance_e2 of R, G, B in each 2x2 cell
/// @param light_e          signal of a white pixel
/// @param added            variance of the codes' rounding, in fractions of white squared
NoiseProfile residual_profile(const SignalElectrons& signal_e, const std::array<Plane<float>, 3>& site_variance_e2,
                              const PerSite<double>& light_e, double added);

}  // namespace lowlux::isp
