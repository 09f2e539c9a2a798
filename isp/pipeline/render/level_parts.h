#pragma once

#include <optional>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

/// A part of a mosaic whose noise is reduced by one level, or stays.
struct LevelPart {
  Rect core;
  std::optional<denoise::Level> level;
};

/// Cuts `core` into parts of one level each. Regions of one level are joined to rectangles, up to `side` pixels each
/// way, which saves their margins; all of `core` is one part where it has one level, however large it is.
/// @param parts  cleared; grows to as many as there are
void cut_by_level(const NoiseReduction& how, const Rect& core, int side, std::vector<LevelPart>& parts);

/// The most that any part of the frame asks for. Precondition: how.has_level().
denoise::Level most_of(const NoiseReduction& how);

/// Dark charge off a part whose noise stays.
/// @param raw_e  its corner at an even column and row of the active area
void take_dark_off(PlaneView<const float> raw_e, const denoise::RawNoise& noise, PlaneView<float> signal_e,
                   Executor& executor);

/// What is left of the noise of a part that keeps it: see NoiseMaps.
/// @param raw_e  its corner at an even column and row of the active area
/// @param maps   of its cells; all of them
void set_own_noise(const denoise::RawElectronsView& raw_e, const NoiseReduction& how, const denoise::DenoiseMaps& maps);

}  // namespace lowlux::isp
