#pragma once

#include <array>
#include <optional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/noise_facts.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Returns why the noise of a frame cannot be reduced at all; nullopt if it can. Errors: a mosaic that is too small
/// (invalid_argument), unknown noise (insufficient).
std::optional<Error> noise_obstacle(const RawFrame& frame, const RawLevels& levels);

/// Returns whether an automatic choice leaves the noise as it is because the raw was denoised before it was written, as
/// its image shows: what is left is not white, and reducing it takes as much detail as noise.
bool is_denoised_before(const RawFrame& frame, const DenoiseChoice& choice);

/// Returns whether row or column noise is significant and thus subtracted: it is more than the error of its
/// measurement, and more than 3 % of a pixel's noise, as the eye integrates it along a line. Lines that differ by more
/// than a pixel's noise without light are taken for scene structure, such as a blind or a fence, unless the offset is
/// the same in both colours of a line and all along it.
bool lines_are_visible(const denoise::LineOffsets& found, const denoise::RawNoise& noise);

/// Decides how noise is reduced. Errors for a requested level: those of noise_obstacle. For an automatic level these
/// are reasons to leave the noise.
/// @param charge  as plan_develop has it; may be null
Result<NoiseReduction> plan_noise(const RawFrame& frame, const Thumbnail& thumbnail, const RawLevels& levels,
                                  const NoiseRequest& request, Executor& executor, RawElectrons* charge);

// Steps of plan_noise that allocate nothing.

/// Holds the noise of a frame's raw values, and the gains of R, G and B that balance its chroma.
struct NoiseModel {
  NoiseProfile::Source source = NoiseProfile::Source::file;
  denoise::RawNoise noise;
  std::array<double, 3> white_gain{1, 1, 1};
};

/// Returns the noise model of a frame. Precondition: frame.noise, levels.electrons_at_white.
NoiseModel noise_model(const RawFrame& frame, const RawLevels& levels, const std::array<float, 3>& white_gain);

/// Returns the median over all blocks of the signal-to-noise ratio of a mean pixel, with the noise of each block.
/// @param snr  memory; grows to one value for each block
double middle_snr(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                  const Thumbnail& thumbnail, std::vector<double>& snr);

}  // namespace lowlux::isp
