#include "isp/cli/develop/batch_report.h"

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"

namespace lowlux::cli {

void print_outcome(const DevelopArgs& args, const DevelopOutcome& outcome) {
  if (outcome.error) return print_err(fmt::format("{}\n", error_line(outcome.input, *outcome.error)));
  if (!outcome.plan) return;  // skipped
  if (!args.quiet) {
    for (const std::string& warning : outcome.plan->warnings) {
      print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", outcome.input, warning))));
    }
  }
  if (args.json) return;
  if (args.explain) {
    print_out(fmt::format("{}\n{}{}", one_line(outcome.input), outcome.merged ? merge_text(*outcome.merged) : "",
                          explain_text(outcome)));
  }
  if (args.timings) print_out(fmt::format("{}\n{}", one_line(outcome.input), times_text(outcome.times)));
}

void print_defaults(const DevelopArgs& args) {
  if (!args.explain || args.json || args.defaults.items.empty()) return;
  print_out(fmt::format("{}\n", one_line("defaults: " + defaults_text(args.defaults))));
}

void print_counts(const DevelopArgs& args, const BatchCounts& counts, std::chrono::duration<double> took) {
  if (counts.done > 0 && counts.files > 1 && !args.quiet) {
    print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {} of {} files written to {}, {:.1f} s", counts.done,
                                                       counts.files, args.output, took.count()))));
  }
  if (counts.files == 0 && !args.quiet) {
    print_err(fmt::format("lowlux: shard {}/{} contains no raw file\n", args.shard.number, args.shard.count));
  }
  if (counts.skipped > 0 && !args.quiet) {
    print_err(fmt::format("lowlux: {} of {} files skipped: their outputs exist\n", counts.skipped, counts.files));
  }
  if (counts.failed > 0 && counts.files > 1) {
    print_err(fmt::format("lowlux: {} of {} files failed\n", counts.failed, counts.files));
  }
}

}  // namespace lowlux::cli
