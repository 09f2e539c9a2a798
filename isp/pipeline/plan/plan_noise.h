#pragma once

#include <optional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Why the noise of a frame cannot be reduced at all; nullopt if it can. Errors: no Bayer mosaic (unsupported), too
/// small (invalid_argument), unknown noise (insufficient).
std::optional<Error> noise_obstacle(const RawFrame& frame, const DevelopPlan& plan);

/// Row or column noise is taken off where it stands out: its own is more than the error of its measurement, and more
/// than 3 % of a pixel's noise, as the eye follows its sum over a line. More than a pixel's noise is no readout, but a
/// blind or a fence.
bool lines_stand_out(const denoise::LineOffsets& found, const denoise::RawNoise& noise);

/// Decides how noise is reduced. What contradicts the noise model becomes a warning of the plan.
/// @param plan  with black, defects, electrons at white and white gains decided
/// Errors, for a level that was asked for: a frame that is no Bayer mosaic (unsupported), unknown noise (insufficient).
/// For an automatic one these are reasons to leave the noise.
Result<NoiseReduction> plan_noise(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan,
                                  Executor& executor);

// Its steps that allocate nothing.

/// The noise of a frame's raw values and the balance its chroma is counted in. Needs frame.noise, and of the plan
/// black, electrons at white and white gains.
void set_noise_model(const RawFrame& frame, const DevelopPlan& plan, NoiseReduction& out);

/// Signal to noise ratio of a mean pixel of the block in the middle of all, dark blocks first.
/// @param snr  memory; grows to as many figures as there are blocks
double middle_snr(const RawFrame& frame, const DevelopPlan& plan, const denoise::RawNoise& noise,
                  const Thumbnail& thumbnail, std::vector<double>& snr);

}  // namespace lowlux::isp
