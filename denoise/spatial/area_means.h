#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "denoise/denoise_options.h"
#include "denoise/spatial/bands.h"
#include "denoise/spatial/frame_memory.h"
#include "denoise/spatial/layout.h"
#include "isp/base/plane.h"

/// Restores the mean colour of areas (DenoiseOptions::keep_means). Shrinkage keeps the mean of blocks of the coarsest
/// level, 512 sites wide. In smaller areas it moves colours that are below their noise towards those of their
/// surroundings, whatever the prior of chroma.
namespace lowlux::denoise {

/// State of a frame whose noise is reduced.
struct MeansFrame {
  const RawElectronsView& raw;
  const RawNoise& noise;
  double variance_scale;                    // factor of the noise variance of a mean over a square
  std::array<double, 3> white_gain;         // R, G, B
  std::array<double, 3> dark_e;             // R, G, B
  std::array<float, 3> min_e;               // least raw means that variances are computed of
  PlaneView<const std::uint8_t> sources;    // cells of point sources; no data: none
  PlaneView<const std::uint8_t> saturated;  // cells with saturated sites
};

/// Adds to the result what it lacks in the mean of each square of 16 x 16 cells (see layout.h), for R, G and B
/// separately, and to the variances in `maps` those of the means. Values between the centres of squares are bilinear,
/// from nodes such that the mean over each square is that of the raw values, where all of its sites count. NaN,
/// saturated cells and point sources do not count, nor do lamps and what they spoil, whose errors would spread over
/// dark surroundings: sites of more than eight times the variance of the others (harmonic mean), and those that differ
/// from their raw value by more than five standard deviations. Saturated cells stay as they are. Where less than a
/// quarter of the sites of a square count, as much is added as if the others of that quarter lacked nothing.
/// @param signal_e  the result, dark subtracted
void restore_means(const MeansFrame& frame, FrameMemory& memory, const Workers& workers, PlaneView<float> signal_e,
                   const DenoiseMaps& maps);

}  // namespace lowlux::denoise
