#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_page.h"

namespace lowlux::cli {

/// Returns the options of all stages. Error: there is no folder of pictures.
Result<isp::BenchOptions> bench_options(const BenchArgs& args);

/// Runs a stage and notes how it was called. @param call  the command line or call that repeats it
Result<MeasuredStage> measure_stage(const isp::BenchStage& stage, const isp::BenchOptions& options,
                                    const std::string& call);

}  // namespace lowlux::cli
