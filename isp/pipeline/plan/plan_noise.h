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
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Why the noise of a frame cannot be reduced at all; nullopt if it can. Errors: no Bayer mosaic (unsupported), too
/// small (invalid_argument), unknown noise (insufficient).
std::optional<Error> noise_obstacle(const RawFrame& frame, const RawLevels& levels);

/// Row or column noise is taken off where it stands out: its own is more than the error of its measurement, and more
/// than 3 % of a pixel's noise, as the eye follows its sum over a line. More than a pixel's noise is no readout, but a
/// blind or a fence.
bool lines_stand_out(const denoise::LineOffsets& found, const denoise::RawNoise& noise);

/// What the reduction of a frame's noise goes by.
struct NoiseRequest {
  DenoiseChoice choice;
  OutputSpace space = OutputSpace::srgb;
  std::array<float, 3> white_gain{1, 1, 1};
  std::optional<DecidedLevel> level;  // set: in place of what Mode::automatic chooses
  bool lines = true;                  // false: row and column noise stays, whatever the choice
};

/// Decides how noise is reduced. Errors, for a level that was asked for: a frame that is no Bayer mosaic (unsupported),
/// unknown noise (insufficient). For an automatic one these are reasons to leave the noise.
Result<NoiseReduction> plan_noise(const RawFrame& frame, const Thumbnail& thumbnail, const RawLevels& levels,
                                  const NoiseRequest& request, Executor& executor);

// Its steps that allocate nothing.

/// The noise of a frame's raw values, and the gains of R, G and B that its chroma is balanced by.
struct NoiseModel {
  NoiseProfile::Source source = NoiseProfile::Source::file;
  denoise::RawNoise noise;
  std::array<double, 3> white_gain{1, 1, 1};
};

/// Precondition: frame.noise, levels.electrons_at_white.
NoiseModel noise_model(const RawFrame& frame, const RawLevels& levels, const std::array<float, 3>& white_gain,
                       OutputSpace space);

/// Signal to noise ratio of a mean pixel of the block in the middle of all, dark blocks first.
/// @param snr  memory; grows to as many figures as there are blocks
double middle_snr(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                  const Thumbnail& thumbnail, std::vector<double>& snr);

}  // namespace lowlux::isp
