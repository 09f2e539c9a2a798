#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/bench/methods/method.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_page.h"

namespace lowlux::cli {

/// Methods that a command line asks for, and ready ones among them that are not installed.
struct RequestedMethods {
  std::vector<isp::ScoredMethod> methods;
  std::vector<Error> not_installed;
};

/// Returns the levels of `lowlux denoise` as methods, run by this command. Error: /proc is not mounted.
Result<std::vector<isp::ScoredMethod>> own_methods();

/// Makes methods of the texts of --method. Error: one is not valid, or two have one name.
Result<RequestedMethods> requested_methods(const std::vector<std::string>& texts);

/// Returns an Error unless all names differ.
Result<void> check_method_names(const std::vector<isp::ScoredMethod>& methods);

/// Returns the options of all stages. Error: there is no folder of pictures.
Result<isp::BenchOptions> bench_options(const BenchArgs& args);

/// Runs a stage and notes how it was called. @param call  the command line or call that repeats it
Result<MeasuredStage> measure_stage(const isp::BenchStage& stage, const isp::BenchOptions& options,
                                    const std::string& call);

}  // namespace lowlux::cli
