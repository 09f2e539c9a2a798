#pragma once

#include <optional>
#include <span>
#include <vector>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/measure/thumbnail.h"

/// What changes of raw values are worth in the picture. A difference of pictures is measured as it is seen from some
/// distance: means of light over 8 x 8 pixels, CIEDE2000 between them, and of that the 95th percentile over the pixels.
namespace lowlux::isp {

inline constexpr int seen_box_px = 8;
inline constexpr double seen_share = 0.95;  // of the pixels: the others may differ more

/// A part of the frame: what is known of its light and of what noise does there.
struct SeenBlock {
  float x = 0;                // of its middle, share of the width
  float y = 0;                // of the height
  float snr = 0;              // of one mean pixel, dark charge off
  float surroundings = 1;     // standard deviation of the noise around it over that of its own, 1..2
  float noise_delta_e = 0;    // root mean square CIEDE2000 of the noise, in means over 8 x 8 pixels
  float clip_delta_e = 0;     // CIEDE2000 that clipping its noise at black makes of the means
  float dark_delta_e = 0;     // CIEDE2000 of its mean dark charge, were it left in
  float line_delta_e = 0;     // CIEDE2000 for each electron that all its pixels have too much
  float point_delta_e = 0;    // the same of one pixel alone, of the colour where that shows most
  float display_delta_e = 0;  // CIEDE2000 of the change for another display, if one is planned
};

/// Up to 256 blocks, evenly spread over the frame. With C the colour as it will be displayed and s_c the standard
/// deviation of the mean of the 16, 32 and 16 samples of R, G and B that 64 pixels hold,
///     noise_delta_e^2 = sum over c of CIEDE2000(C(r), C(r + s_c))^2.
/// Clipping raises the mean of a displayed primary p, whose pixels scatter by d around m, by d (phi(m / d) + m / d
/// Phi(m / d)) - max(m, 0); the luminance is kept, as moving colours into the gamut does.
/// Empty for spaces without primaries. Precondition: levels.electrons_at_white.
std::vector<SeenBlock> seen_blocks(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                                   const Rendering& rendering, const denoise::RawNoise& noise,
                                   const Thumbnail& thumbnail, Executor& executor);

/// The difference that 5 % of the pixels exceed, each block's being normal with this root mean square: to 1.5e-7 of the
/// largest. 0 where no more than 5 % of the blocks have any.
double seen_percentile(std::span<const float> rms_delta_e);

/// What a level of noise reduction leaves of the visible noise, against Level::high, for blocks of this signal to noise
/// ratio in even surroundings: about the most that pictures showed, but for lamps in the dark; nullopt is no reduction.
/// tests/bench/planner_bench.cpp prints what was seen over it.
double left_of_noise(std::optional<denoise::Level> level, double snr);

/// Root mean square CIEDE2000 of that: left_of_noise() of the noise of the surroundings, which thresholds go by, and
/// without reduction what clipping at black makes of it.
float left_delta_e(std::optional<denoise::Level> level, const SeenBlock& block);

/// What is left of it against the truth, for telling which of two plans is better.
double error_share(std::optional<denoise::Level> level);

}  // namespace lowlux::isp
