#pragma once

#include "isp/bench/bench_stages.h"

namespace lowlux::isp {

/// Runs the stage `methods`: scores BenchOptions::methods on the same raw frames. A method that fails on a frame is
/// left out, and BenchOutcome::failures says why. Errors: an image cannot be read.
Result<BenchOutcome> run_methods_bench(const BenchOptions& options);

}  // namespace lowlux::isp
