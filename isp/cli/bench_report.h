#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench_args.h"

namespace lowlux::cli {

/// A stage and what it yielded.
struct MeasuredStage {
  isp::BenchStage stage;
  isp::BenchOutcome outcome;
};

/// For a terminal: how it was measured, the table, the findings.
std::string bench_text(const MeasuredStage& measured);

/// One JSON array, an object for each stage: stage, remarks, rows with the table's columns as keys (null where there is
/// no figure), findings.
std::string bench_json(const std::vector<MeasuredStage>& measured);

/// Before the work: makes the folder, and sees what keeps STAGE.csv, STAGE.json and STAGE.html from being written to
/// the folder `output`.
Result<void> check_bench_files(const std::vector<isp::BenchStage>& stages, const BenchArgs& args);

/// Writes all files of all stages; nothing if one is in the way.
Result<void> write_bench_files(const std::vector<MeasuredStage>& measured, const BenchArgs& args, Executor& executor);

}  // namespace lowlux::cli
