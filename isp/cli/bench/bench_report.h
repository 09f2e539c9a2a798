#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_page.h"
#include "isp/cli/shared/machine.h"

namespace lowlux::cli {

/// Returns the text for a terminal: how it was measured, the table, the findings.
std::string bench_text(const MeasuredStage& measured);

/// Returns one JSON array, an object for each stage: stage, machine, took_s, remarks, rows with the table's columns as
/// keys (null where a value is missing), findings.
std::string bench_json(const std::vector<MeasuredStage>& measured, const Machine& machine);

/// Before the work, makes the folder `output` and checks that bench.html, STAGE.csv and STAGE.json can be written.
Result<void> check_bench_files(const std::vector<isp::BenchStage>& stages, const BenchArgs& args);

/// Writes bench.html and all files of all stages; nothing if one exists. Returns their paths, in the order of writing.
Result<std::vector<std::string>> write_bench_files(const std::vector<MeasuredStage>& measured, const Machine& machine,
                                                   const BenchArgs& args, Executor& executor);

}  // namespace lowlux::cli
