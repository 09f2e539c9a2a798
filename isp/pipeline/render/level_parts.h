#pragma once

#include <optional>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

/// Holds a tile of a mosaic whose noise is reduced by one level, or stays.
struct LevelPart {
  Rect core;
  std::optional<denoise::Level> level;
};

/// Splits `core` into tiles of one level each. Regions of one level are joined to rectangles, up to `side` pixels each
/// way, which saves their margins; all of `core` is one tile where it has one level, however large it is.
/// @param parts  cleared; grows to the number of tiles
void split_by_level(const NoiseReduction& how, const Rect& core, int side, std::vector<LevelPart>& parts);

/// Returns the highest level of any region of the frame. Precondition: how.has_level().
denoise::Level max_level_of(const NoiseReduction& how);

/// Subtracts dark charge from a tile whose noise stays.
/// @param raw_e  its corner at an even column and row of the active area
void subtract_dark_charge(PlaneView<const float> raw_e, const denoise::RawNoise& noise, PlaneView<float> signal_e,
                          Executor& executor);

/// Sets the maps of a tile that keeps its noise: see NoiseMaps.
/// @param raw_e  its corner at an even column and row of the active area
/// @param maps   maps of the tile's cells; none may be absent
void set_own_noise(const denoise::RawElectronsView& raw_e, const NoiseReduction& how, const denoise::DenoiseMaps& maps);

}  // namespace lowlux::isp
