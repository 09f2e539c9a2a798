#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/peers/denoise_methods.h"

namespace lowlux::isp {

/// One method in one light: means over the pictures.
struct DenoiseRow {
  std::string method;
  MethodKind kind = MethodKind::other;
  DenoiseLight light;
  PictureError error;
  double s_per_mp = 0;  // CPU time of the denoising alone, one thread; not a number for what has none
  /// spread_of() the rounds, mean of the pictures that have several
  double spread = std::numeric_limits<double>::quiet_NaN();
  double times_memcpy = 0;  // of that of copying the mosaic
  double speed_of_nlm = 0;  // how many times faster than opencv-nlm in this light; not a number without it
  bool undominated =
      false;  // no other row of this light is better in one of (time, CIEDE2000) and not worse in the other
};

/// The lights: 2000 to 1 e- over 2 e- of dark, 20 to 1 e- over 200 e-; quick: two of them.
std::vector<DenoiseLight> denoise_lights(bool quick);

/// Sets `undominated` of all rows; those of kind ceiling compete with none.
void mark_undominated(std::span<DenoiseRow> rows);

/// What the denoiser must show, beside what it shows: those findings whose rows are there. Needs rows marked.
std::vector<Finding> denoise_findings(std::span<const DenoiseRow> all);

/// The rows as a table.
BenchTable denoise_table(std::span<const DenoiseRow> rows);

/// Error against time, a plot for each light: the rows, the undominated joined by a line.
std::vector<Plot> denoise_plots(std::span<const DenoiseRow> rows);

/// The stage `denoise`. Errors: a picture cannot be read; a method failed.
Result<BenchOutcome> run_denoise_bench(const BenchOptions& options);

}  // namespace lowlux::isp
