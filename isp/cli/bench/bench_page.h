#pragma once

#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/shared/machine.h"

namespace lowlux::cli {

/// A stage and what it yielded.
struct MeasuredStage {
  isp::BenchStage stage;
  isp::BenchOutcome outcome;
  double took_s = 0;  // wall clock, of all its work and not only of what is timed
};

/// "2 stages took 12.3 s".
std::string time_text(const std::vector<MeasuredStage>& measured);

/// Significant digits of figures that are read.
inline constexpr int shown_digits = 4;

/// One page of all that was measured: the machine, how many findings hold, then a section for each stage, those of the
/// whole pipeline (develop, simulate) first. Error: no memory for a picture.
Result<std::string> bench_page(const std::vector<MeasuredStage>& measured, const Machine& machine, Executor& executor);

}  // namespace lowlux::cli
