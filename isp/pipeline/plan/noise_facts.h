#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "denoise/check/noise_check.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/options.h"
#include "isp/raw/measure/thumbnail.h"

/// Measurements on which decisions about noise reduction are based, for mosaics and other frames.
namespace lowlux::isp {

/// Values slightly below white are saturated too, because pixels do not all saturate at one code.
inline constexpr double saturated_fraction_of_white = 0.99;

/// Holds what the reduction of a frame's noise is decided by.
struct NoiseRequest {
  DenoiseChoice choice;
  OutputSpace space = OutputSpace::srgb;
  std::array<float, 3> white_gain{1, 1, 1};
  std::optional<DecidedLevel> level;  // set: used instead of the choice of Mode::automatic
  bool lines = true;                  // false: row and column noise stays, whatever the choice
};

/// Returns the median over all blocks of the signal-to-noise ratio of a mean pixel, with the noise of each block.
/// @param electrons  electrons of R, G, B at white
/// @param snr        memory; grows to one value for each block
double middle_snr(const RawFrame& frame, const Thumbnail& thumbnail, const std::array<double, 3>& electrons,
                  const denoise::RawNoise& noise, std::vector<double>& snr);

/// Returns the level that is asked for, else that of the signal-to-noise ratio of a pixel in the median block.
std::optional<denoise::Level> level_by_ratio(const DenoiseChoice& choice, double snr);

/// Sets the level and its reason: as requested, else as decided, else by the signal-to-noise ratio `out.snr`, which is
/// set.
void choose_level(const NoiseRequest& request, NoiseReduction& out);

/// Adds what is suspicious about a frame. A model that was measured on the frame itself is not held against it: its
/// uncertainty was stated where it was measured. Where the file states that its noise was reduced, less than its model
/// has on fine scales is as expected.
void add_remarks(const denoise::NoiseCheck& check, const NoiseProfile& model, std::vector<std::string>& warnings);

}  // namespace lowlux::isp
