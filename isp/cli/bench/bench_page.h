#pragma once

#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/shared/machine.h"

namespace lowlux::cli {

/// Holds a stage and its results.
struct MeasuredStage {
  isp::BenchStage stage;
  isp::BenchOutcome outcome;
  double took_s = 0;  // wall clock, of all its work and not only of the timed work
};

/// Returns "2 stages took 12.3 s".
std::string time_text(const std::vector<MeasuredStage>& measured);

/// Number of significant digits in texts for people.
inline constexpr int shown_digits = 4;

/// Returns one page with all measurements: the machine, how many findings hold, then a section for each stage, those of
/// the entire pipeline (develop, simulate) first. Error: no memory for an image.
Result<std::string> bench_page(const std::vector<MeasuredStage>& measured, const Machine& machine, Executor& executor);

}  // namespace lowlux::cli
