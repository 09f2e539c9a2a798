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
#include "isp/raw/repair.h"

/// This header predicts how visible errors of raw values are in the image. A difference of images is measured as it is
/// perceived from some distance: means of light over 8 x 8 pixels, CIEDE2000 between them, and of that the 95th
/// percentile over the pixels. Such means hide single pixels and lines, which are rated by their own contrast.
namespace lowlux::isp {

inline constexpr int visible_box_px = 8;
inline constexpr double seen_fraction = 0.95;  // fraction of the pixels: the others may differ more

/// Describes a block of the frame: what is known of its light and of the effect of noise there.
struct VisibilityBlock {
  float x = 0;                // x coordinate of its centre, fraction of the width
  float y = 0;                // y coordinate of its centre, fraction of the height
  float snr = 0;              // signal-to-noise ratio of one mean pixel, dark charge subtracted
  float surroundings = 1;     // standard deviation of the noise around it over its own, 1..2
  float noise_delta_e = 0;    // root mean square CIEDE2000 of the noise, in means over 8 x 8 pixels
  float clip_delta_e = 0;     // CIEDE2000 that clipping its noise at black causes in the means
  float dark_delta_e = 0;     // CIEDE2000 of its mean dark charge, if it were left in
  float line_delta_e = 0;     // CIEDE2000 for each excess electron in all its pixels
  float display_delta_e = 0;  // CIEDE2000 of the change for another display, if one is planned
};

/// Returns up to 256 blocks, evenly spread over the frame. With C the colour as it will be displayed and s_c the
/// standard deviation of the mean of the 16, 32 and 16 samples of R, G and B that 64 pixels hold,
///     noise_delta_e^2 = sum over c of CIEDE2000(C(r), C(r + s_c))^2.
/// Frames that are not mosaics have 64 samples of each colour; those of a monochrome frame move together.
/// Clipping raises the mean of a displayed primary p, whose pixels scatter by d around m, by d (phi(m / d) + m / d
/// Phi(m / d)) - max(m, 0); the luminance is kept, as moving colours below black into the gamut does.
/// Empty for spaces without primaries. Precondition: levels.electrons_at_white.
std::vector<VisibilityBlock> visibility_blocks(const RawFrame& frame, const DevelopOptions& options,
                                               const RawLevels& levels, const Rendering& rendering,
                                               const denoise::RawNoise& noise, const Thumbnail& thumbnail,
                                               Executor& executor);

/// Describes a pixel of a Bayer frame that differs from its surroundings.
struct DeviatingPixel {
  Pixel at;
  double excess = 0;  // fraction of white; negative where the pixel is too dark
};

/// Returns the CIEDE2000 between such a pixel and its block of the thumbnail, in the image, demosaiced by linear
/// filters. Absent for spaces without primaries.
/// @param light  dark charge subtracted
std::optional<double> pixel_delta_e(const RawDn& raw, const DevelopOptions& options, const Rendering& rendering,
                                    const Thumbnail& light, const DeviatingPixel& pixel);

/// Returns the difference that 5 % of the pixels exceed, each block's being normal with this root mean square: to
/// 1.5e-7 of the largest. Returns 0 where no more than 5 % of the blocks have any.
double visible_percentile(std::span<const float> rms_delta_e);

/// Returns the fraction of the visible noise that a level of noise reduction leaves, relative to Level::high, for
/// blocks of this signal-to-noise ratio in even surroundings: about the largest value over images, except for lamps in
/// the dark; nullopt is no reduction. `measure planner` prints measured values relative to it.
double residual_noise_fraction(std::optional<denoise::Level> level, double snr);

/// Returns the root mean square CIEDE2000 that a level leaves of a block's noise: residual_noise_fraction() of the
/// noise of the surroundings, which determine thresholds, and without reduction also the effect of clipping at black.
float residual_delta_e(std::optional<denoise::Level> level, const VisibilityBlock& block);

/// Returns the fraction of the noise that a level leaves relative to the truth, for deciding which of two plans is
/// better.
double error_fraction(std::optional<denoise::Level> level);

}  // namespace lowlux::isp
