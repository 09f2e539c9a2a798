#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>

#include "denoise/layout.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
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

/// Reduces the noise of a Bayer mosaic: joint multi-scale DCT on cells, with hard thresholds and empirical Wiener
/// weights in the linear domain, after G. Yu, G. Sapiro (IPOL 2011) and N. Pierazzo, J.-M. Morel, G. Facciolo (IPOL 7,
/// 2017). README.md has the equations; tests/reference/denoise_ref.h is the same in plain double.
///
/// Owns its memory and allocates only in the constructor; does one frame at a time. The result is the same, bit for
/// bit, for every number of threads.
class Denoiser {
 public:
  /// For mosaics of up to max_width x max_height pixels, each 2..65536, and up to `threads` of an executor's threads.
  /// Takes about 22 bytes for each pixel, and 2 MB for each thread of a mosaic 4000 wide.
  /// @param most  no frame may ask for more; Level::best takes 2.4 MB more for each thread of a mosaic 4000 wide
  Denoiser(int max_width, int max_height, int threads, Level most = Level::high);
  /// Of memory that one takes, to the last plane.
  static std::size_t bytes(int max_width, int max_height, int threads, Level most = Level::high);
  ~Denoiser();
  Denoiser(const Denoiser&) = delete;
  Denoiser& operator=(const Denoiser&) = delete;

  /// @param raw  at least 2 x 2 pixels; any phase, odd sizes too
  /// @param signal_e  as large as `raw`; denoised, dark subtracted, signed [e-]. May not overlap `raw`.
  void run(const RawElectronsView& raw, const RawNoise& noise, const DenoiseOptions& options, PlaneView<float> signal_e,
           const DenoiseMaps& maps, Executor& executor);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The vector instruction set the kernels use on this machine, as Highway names it.
const char* denoiser_target();

}  // namespace lowlux::denoise
