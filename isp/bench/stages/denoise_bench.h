#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/peers/denoise_methods.h"

namespace lowlux::isp {

/// One method in one light: means over the images.
struct DenoiseRow {
  std::string method;
  MethodKind kind = MethodKind::other;
  DenoiseLight light;
  PictureError error;
  double patch_uv = 0;        // distance of patches from the truth in u'v' (PatchBound)
  double patch_uv_bound = 0;  // the Cramer-Rao bound of it
  double s_per_mp = 0;        // CPU time of the denoising alone, one thread; not a number if it was not timed
  /// Mean of spread_of() the rounds over the images that have several rounds.
  double spread = std::numeric_limits<double>::quiet_NaN();
  double times_memcpy = 0;  // ratio to the time of copying the mosaic
  double speed_of_nlm = 0;  // speed relative to opencv-nlm in this light; not a number without it
  bool undominated =
      false;  // no other row of this light is better in one of (time, CIEDE2000) and not worse in the other
};

/// Returns the lights: 2000 to 1 e- over 2 e- of dark, 20 to 1 e- over 200 e-; quick: two of them.
std::vector<DenoiseLight> denoise_lights(bool quick);

/// Sets `undominated` of all rows; those of kind ceiling do not take part in the comparison.
void mark_undominated(std::span<DenoiseRow> rows);

/// Returns the checks that the denoiser must pass, for the rows that exist. `undominated` must be set.
std::vector<Finding> denoise_findings(std::span<const DenoiseRow> all);

/// Returns the rows as a table.
BenchTable denoise_table(std::span<const DenoiseRow> rows);

/// Plots error against time, one plot for each light: the rows, the Pareto-optimal ones joined by a line.
std::vector<Plot> denoise_plots(std::span<const DenoiseRow> rows);

/// Runs the stage `denoise`. Errors: an image cannot be read; a method failed.
Result<BenchOutcome> run_denoise_bench(const BenchOptions& options);

}  // namespace lowlux::isp
