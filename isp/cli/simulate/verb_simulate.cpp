#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/cli/simulate/simulate_files.h"
#include "isp/cli/simulate/simulate_report.h"
#include "isp/cli/simulate/simulate_work.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

void print_simulated(const SimulateArgs& args, const SimulateOutcome& outcome) {
  if (!args.quiet) {
    for (const std::string& warning : outcome.warnings) {
      print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", args.scene.what, warning))));
    }
  }
  if (args.json) {
    print_out(fmt::format("{}\n", simulate_json(args, outcome)));
    return;
  }
  if (!args.quiet) print_out(fmt::format("{}", simulate_text(args, outcome)));
  if (args.explain) print_out(fmt::format("{}", explain_text(args, outcome)));
  if (args.timings) print_out(fmt::format("{}", times_text(outcome.times)));
}

}  // namespace

int run_simulate(const std::vector<std::string>& words) {
  const Parsed<SimulateArgs> parsed = parse_simulate(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<SimulateArgs>(parsed);
  if (args.list) {
    print_out(args.json ? simulate_list_json() + "\n" : simulate_list());
    return exit_done;
  }
  if (const std::string wrong = wrong_files(args); !wrong.empty()) {
    return print_usage_error("simulate", {ErrorCode::invalid_argument, wrong, {}}, object_if(args.json));
  }
  const Result<SimulateOutcome> outcome = simulate(args);
  if (!outcome) {
    const Error& error = outcome.error();
    if (error.code != ErrorCode::invalid_argument) return print_failure(args.scene.what, error, object_if(args.json));
    const std::string place = error.where.empty() ? "" : " (" + error.where + ")";
    return print_usage_error("simulate", {error.code, error.message + place, {}}, object_if(args.json));
  }
  print_simulated(args, *outcome);
  return exit_done;
}

}  // namespace lowlux::cli
