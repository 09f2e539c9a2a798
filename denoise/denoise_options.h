#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "denoise/spatial/layout.h"
#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::denoise {

/// How much work is done; the ladder of docs and of tests/bench/denoise_bench.cpp.
enum class Level : std::uint8_t {
  draft,     // hard thresholds, blocks every 4 quads
  standard,  // then empirical Wiener weights from that result, blocks every 4 quads
  high,      // the same with blocks every 2 quads
  best,      // both passes with blocks every 2 quads, then non-local Bayes
};

inline constexpr std::array all_levels{Level::draft, Level::standard, Level::high, Level::best};  // least work first

/// "draft" and so on.
std::string_view name_of(Level level);

/// The largest electrons that count, and the largest variance of noise that is taken [e-^2]. No sensor has them.
inline constexpr double largest_e = 1e9;

/// A mosaic in electrons, pedestal removed, dark charge still in, signed. Sites that are not a number count as 0, and
/// values beyond +-largest_e as +-largest_e.
struct RawElectronsView {
  PlaneView<const float> value;
  BayerPhase phase = BayerPhase::rggb;
};

inline constexpr double unsaturated_e = std::numeric_limits<double>::infinity();

/// Var[y] = max(E[y], 0) + variance_e2 of a raw value y [e-] of one colour. All in 0..largest_e, but for saturation_e.
struct RawNoise {
  PerSite<double>
      dark_mean_e{};  // subtracted, sites as in site_of(); both greens get the mean of theirs, or mazes show
  std::array<double, 3> variance_e2{};  // of R, G, B: read noise^2 + quantisation step^2 / 12; both greens share theirs
  /// Values from here on are saturated: they count as the largest white-balanced value of their 2x2 cell, which becomes
  /// neutral, whatever DenoiseOptions::rho, and gives no colour to its surroundings.
  std::array<double, 3> saturation_e{unsaturated_e, unsaturated_e, unsaturated_e};  // of R, G, B
};

struct DenoiseOptions {
  Level level = Level::standard;
  std::array<double, 3> white_gain{1, 1, 1};  // R, G, B; 1e-3..1e3. Undone at the end; neutral detail must be equal
  /// Prior standard deviation of chroma relative to luma: chroma C becomes C L^2 rho^2 / (L^2 rho^2 + its variance).
  /// > 0; infinity leaves chroma as it is.
  double rho = 1.5;
  /// Finest pyramid level on which chroma is estimated, 0..2; absent: from the signal to noise ratio of each tile of
  /// 64 x 64 cells, blended; with Level::best 0 or 2 only.
  std::optional<int> chroma_start;
  bool keep_point_sources = true;  // stars pass as they were measured: see point_sources.h
  /// Variance of the noise over that of RawNoise, on each pyramid level, finest first; 0.01..100. Not 1 where noise is
  /// not white, as in raws that were denoised or compressed with loss before: see noise_check.h. The search for point
  /// sources goes by RawNoise alone.
  std::array<double, most_levels> variance_scale{1, 1, 1, 1, 1};
};

/// Optional outputs for each 2x2 cell, ceil(height / 2) x ceil(width / 2); views without data are left out.
struct DenoiseMaps {
  PlaneView<float> residual_variance;  // of white-balanced luma 0.2 R + 0.3 G1 + 0.3 G2 + 0.2 B [e-^2]
  /// 0..1, the factor above for the mean variance of the two colour differences; 0 where a site is saturated.
  PlaneView<float> chroma_confidence;
  /// Predicted variance of the noise that is left in a site of R, G and B [e-^2], white balance undone: with the
  /// planes' residual variances r and the factors f of their confidence,
  ///     (r_L + 0.36 f1^2 r_C1 + f2^2 r_C2 / 2) / gain^2 of R and B,  (r_L + 0.16 f1^2 r_C1 + f3^2 r_C3 / 4) / gain^2
  /// of G.
  /// What rho takes from colour is not in it, nor is that point sources are left as noisy as they were.
  std::array<PlaneView<float>, 3> site_variance;
};

}  // namespace lowlux::denoise
