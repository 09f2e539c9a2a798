#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "denoise/spatial/layout.h"
#include "isp/base/cfa.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/plane.h"

namespace lowlux::denoise {

/// The amount of work; docs/ and `measure denoise` compare the levels.
enum class Level : std::uint8_t {
  draft,     // hard thresholds, blocks every 4 quads
  standard,  // hard thresholds, then empirical Wiener weights from that result, blocks every 4 quads
  high,      // like `standard`, but with blocks every 2 quads
  best,      // both passes with blocks every 2 quads, then non-local Bayes
};

inline constexpr std::array all_levels{Level::draft, Level::standard, Level::high, Level::best};  // least work first

/// Returns the name of a level, such as "draft".
std::string_view name_of(Level level);

/// The largest absolute value of an electron count, and the largest variance of noise that is accepted [e-^2]. No
/// sensor reaches them.
inline constexpr double largest_e = 1e9;

/// A mosaic in electrons, pedestal removed, dark charge still in, signed. NaN sites count as 0, and values beyond
/// +-largest_e as +-largest_e.
struct RawElectronsView {
  PlaneView<const float> value;
  BayerPhase phase = BayerPhase::rggb;
  NoiseRatioView noise_ratio{};  // ratio of each value's variance to that of RawNoise; 1e-6..1e6
};

inline constexpr double unsaturated_e = std::numeric_limits<double>::infinity();

/// Noise of a raw value y [e-] of one colour: Var[y] = r (max(E[y], 0) + variance_e2), where r is
/// RawElectronsView::noise_ratio, usually 1. All members are in 0..largest_e, except saturation_e.
struct RawNoise {
  PerSite<double>
      dark_mean_e{};  // subtracted, sites as in site_of(); both greens get their mean, to avoid maze patterns
  std::array<double, 3> variance_e2{};  // for R, G, B: read noise^2 + quantisation step^2 / 12; greens share one value
  /// Values of at least this are saturated: they count as the largest white-balanced value of their 2x2 cell, and do
  /// not affect the colour of its surroundings. A cell of four saturated values becomes neutral, whatever
  /// DenoiseOptions::rho; the values of a cell with fewer stay as they were measured.
  std::array<double, 3> saturation_e{unsaturated_e, unsaturated_e, unsaturated_e};  // levels of R, G, B
};

/// Holds the options of Denoiser.
struct DenoiseOptions {
  Level level = Level::standard;
  std::array<double, 3> white_gain{1, 1, 1};  // R, G, B; 1e-3..1e3. Undone at the end; neutral detail must be equal
  /// Prior standard deviation of chroma relative to luma, both of stabilised values: chroma C becomes C L^2 rho^2 /
  /// (L^2 rho^2 + its variance). > 0; infinity leaves chroma as the transforms estimate it.
  double rho = 1.5;
  /// Finest pyramid level on which chroma is estimated, 0..2; if absent, it follows from the signal to noise ratio of
  /// each tile of 64 x 64 cells, blended. With Level::best only 0 or 2.
  std::optional<int> chroma_start;
  /// The four sites of a cell are at one place, as those of a pixel that has all colours: a slope of the luma is no
  /// difference between them (spatial/site_slopes.h).
  bool sites_coincide = false;
  bool keep_point_sources = true;  // stars pass unfiltered: see point_sources.h
  /// The means of R, G and B over squares of 16 x 16 cells are those of the raw values: what the result lacks is added
  /// again (spatial/area_means.h). It costs the noise of such means. Without it, colours below their noise are moved
  /// towards those of their surroundings, also for an infinite rho.
  bool keep_means = false;
  /// Ratio of the noise variance to that of RawNoise on each pyramid level, finest first; 0.01..100. It differs from 1
  /// where noise is not white, as in raws that were already denoised or compressed with loss: see noise_check.h. The
  /// search for point sources uses RawNoise alone.
  std::array<double, max_levels> variance_scale{1, 1, 1, 1, 1};
};

/// Optional outputs for each 2x2 cell, ceil(height / 2) x ceil(width / 2); views without data are not written.
struct DenoiseMaps {
  PlaneView<float> residual_variance;  // variance of white-balanced luma 0.2 R + 0.3 G1 + 0.3 G2 + 0.2 B [e-^2]
  /// The factor of DenoiseOptions::rho, 0..1, for the mean variance of the two colour differences; 0 where a site is
  /// saturated.
  PlaneView<float> chroma_confidence;
  /// Predicted variance of the remaining noise in a site of R, G and B [e-^2], white balance undone. With the residual
  /// variances r of the planes of stabilised values, the factors f of their confidence and the slope b of the light of
  /// such a value (spatial/stabiliser.h) it is
  ///     b^2 (r_L + 0.36 f1^2 r_C1 + f2^2 r_C2 / 2) / gain^2 for R and B,
  ///     b^2 (r_L + 0.16 f1^2 r_C1 + f3^2 r_C3 / 4) / gain^2 for G.
  /// It includes neither the colour that rho removes nor the unreduced noise of point sources. With
  /// DenoiseOptions::keep_means, this and residual_variance include the variance of the means.
  std::array<PlaneView<float>, 3> site_variance;
};

}  // namespace lowlux::denoise
