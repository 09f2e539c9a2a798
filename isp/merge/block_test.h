#pragma once

#include <array>
#include <cstdint>

#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/block_rows.h"

namespace lowlux::merge {

inline constexpr int block_px = 8;  // side of the blocks that are compared

/// Describes the noise of a mosaic whose mean signal is mu: the variance is fraction * (max(mu, 0) + variance_e2 of the
/// site), for example with fraction = 1 / n in a mean of n frames, in the light of the reference.
struct MosaicNoise {
  PerSite<double> variance_e2{};
  double fraction = 1;
};

/// Returns the noise of a frame whose values were divided by `light`, the ratio of its signal to the reference's:
/// Var[y / light] = (light mu + variance_e2) / light^2.
MosaicNoise noise_in_light(const PerSite<double>& variance_e2, double light);

/// Describes the blocks of a reference that are those of one frame, in a reference that is otherwise a mean of several.
struct SingleFrameBlocks {
  PlaneView<const std::uint8_t> is_single{};  // like Comparison::block_matches; without data there are none
  MosaicNoise noise;
  double block_false_alarm = 0.1;  // replaces that of the comparison: other frames often differ there
};

/// Describes how two mosaics of one scene are compared.
struct ComparisonOptions {
  /// Fraction of the blocks of a static scene that do not match, 1e-6..0.5.
  double block_false_alarm = 1e-3;
  /// Fraction of the sites of a static scene that are outliers, 1e-9..0.1; 0: sites are not tested. Only useful where
  /// the reference is itself free of outliers.
  double site_false_alarm = 0;
  /// Standard error of the displacement between the two mosaics, for each axis [px]. Detail may differ by that much.
  double displacement_error_px = 0;
  SingleFrameBlocks single_frame;
};

/// Holds the result of a comparison.
struct Comparison {
  Plane<std::uint8_t> block_matches;  // ceil(height / 8) x ceil(width / 8): 1 where both show the same scene
  std::int64_t outliers = 0;          // sites set to NaN in the frame
  double matching_fraction = 0;       // fraction of the comparable blocks that match
  /// Mean over all compared blocks of the squared difference over its predicted variance; 1 for a static scene.
  double mean_chi_square = 0;
};

/// Compares a frame with the reference in blocks of 8 x 8 sites by the known noise of both.
///
/// For each block and each of the four sites of a CFA cell, V is the variance of the difference d = frame - reference
/// for the mean signal of both, weighted by inverse variance; with this weight it does not correlate with d. Two
/// statistics are computed, with sums over the block,
///     step = sum over sites of (sum d)^2 / sum V,    spread = sum d^2 / V - step,
/// for the block and for the four squares of 2 x 2 blocks that contain it. Normal d would make them independent
/// chi-square variables; for Poisson counts the fourth cumulant lambda is added to their variances. Their quantiles are
/// those of gamma variables (E. B. Wilson, M. M. Hilferty, PNAS 17, 1931). A block does not match if a statistic is
/// above its threshold, or above a lower threshold next to a block that does not match.
///
/// A site is an outlier if d is beyond the quantiles of the stated rate, corrected for skewness (Cornish and Fisher
/// 1937). Outliers do not count in the statistics and become NaN in the frame. Sites that are NaN in either mosaic do
/// not count.
/// @param reference  height x width; with the noise `reference_noise`
/// @param frame      as large, in the light of the reference; outliers are set to NaN
Comparison compare_mosaics(PlaneView<const float> reference, const MosaicNoise& reference_noise, PlaneView<float> frame,
                           const MosaicNoise& frame_noise, const ComparisonOptions& options, Executor& executor);

/// Compares many pairs of mosaics whose noise is the same, such as single blocks: finding the thresholds takes longer
/// than comparing one block.
class MosaicComparer {
 public:
  MosaicComparer(const MosaicNoise& reference_noise, const MosaicNoise& frame_noise, const ComparisonOptions& options);

  /// See compare_mosaics.
  Comparison compare(PlaneView<const float> reference, PlaneView<float> frame, Executor& executor) const;

 private:
  /// Holds normal quantiles: of a block by itself, of one next to a block that does not match, and of a site (0: none).
  struct Thresholds {
    float alone;
    float neighbour;
    float site;
  };

  static Thresholds thresholds_of(double block_false_alarm, double site_false_alarm);

  ComparisonOptions options_;
  std::array<rows::BlockNoise, 2> noise_;  // noise of the blocks of the mean, and of those of a single frame
  std::array<Thresholds, 2> thresholds_;   // the same
};

}  // namespace lowlux::merge
