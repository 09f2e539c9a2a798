#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_page.h"
#include "isp/cli/shared/machine.h"
#include "isp/reproduce/reproduce.h"

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

/// Returns the findings as a table for a terminal: finding, kind, published, ours, verdict, wrapped to about 120
/// columns; the note follows where a finding does not agree. The last lines count the verdicts of published findings
/// and of this project's own checks, and state the tolerances.
std::string findings_text(std::span<const isp::Finding> findings);

/// Returns the parts of the thesis that no experiment reproduces, with the reasons.
std::string not_reproduced_text();

/// Returns one JSON array of objects.
std::string findings_json(std::span<const isp::Finding> findings);

}  // namespace lowlux::cli
