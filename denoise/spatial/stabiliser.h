#pragma once

#include <array>
#include <span>

#include "denoise/denoise_options.h"
#include "denoise/spatial/bands.h"
#include "denoise/spatial/frame_memory.h"

/// Stabilisation of the variance. The variance of a block has to be one number, but that of light x, white-balanced and
/// without dark charge, is g x + g^2 (d + sigma^2): in a block with a lamp, that of the lamp. So the passes work on
///     u = h(x) = 2 x / (1 + sqrt(1 + x / c)),     Var[u] = Var[x] c / (x + c),     x = u + u^2 / (4 c)
/// which is the generalised Anscombe transform (Anscombe 1948) where c = g (d + sigma^2), and linear where c is large.
/// A larger c leaves the variance of dark parts as it is, and less for the curvature to do: u is close to x where x is
/// far below c. Below x = -c / 2, h is continued linearly.
///
/// The mean of x is that of u + u^2 / (4 c), so that noise which is removed from u is missing in x: its variance over
/// 4 c. It is added again, as the fraction of the stated variance that was removed (removed_noise), so that means are
/// kept whether or not the noise is as stated. Where the noise ratio differs from place to place, so does what is
/// missing, and the denoiser would average over it: there values are first made to miss as much as noise of the largest
/// ratio would take.
namespace lowlux::denoise {

/// Returns c = max over colours of g (10 max(r, 1) + 2 r s (d + sigma^2)) [e-, white-balanced], r being the largest
/// noise ratio and s the largest DenoiseOptions::variance_scale.
/// @param dark_e  dark of R, G, B
double stabilising_offset(const std::array<double, 3>& dark_e, const RawNoise& noise, double max_ratio,
                          const DenoiseOptions& options);

/// Computes for each tile of 64 x 64 cells (see layout.h) the fraction of the stated variance that was removed: the sum
/// of (noisy - denoised)^2 over that of the variance, with differences limited to 5 standard deviations, of every third
/// row of cells; 0 where no noise is stated. Sites on the linear part of h do not count.
/// @param value  the denoised planes of level 0
/// @param out    tiles_of(columns) * tiles_of(rows) fractions, row by row
void removed_noise(const PyramidLevel& level, const PlaneSet& value, double offset_e, int columns, int rows,
                   const Workers& workers, std::span<float> out);

}  // namespace lowlux::denoise
