#include <algorithm>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "isp/base/file_extension.h"
#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/merge/merge_files.h"
#include "isp/cli/merge/merge_report.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

/// Holds the files that a run reads and writes, all of them checked.
struct Files {
  std::vector<std::string> inputs;
  CalibrationFiles calibration;
  Job output;
};

Result<Files> input_files(const DevelopArgs& args) {
  Files out;
  out.output = {{}, args.output, args.force ? isp::Overwrite::yes : isp::Overwrite::no};
  if (!has_extension(args.output, ".dng")) {
    return fail(ErrorCode::invalid_argument, "merged raw files are written as DNG: the name must end with .dng", "-o");
  }
  Result<std::vector<std::string>> inputs = files_to_merge(args);
  if (!inputs) return tl::make_unexpected(inputs.error());
  out.inputs = *std::move(inputs);
  std::vector<Job> jobs;
  for (const std::string& input : out.inputs) jobs.push_back({input, args.output, out.output.overwrite});
  Result<CalibrationFiles> calibration = calibration_files(args, jobs);
  if (!calibration) return tl::make_unexpected(calibration.error());
  out.calibration = *std::move(calibration);
  return out;
}

Result<MergeReport> merge_and_write(const DevelopArgs& args, const Files& files, const RawBatch& batch) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64));
  Progress whole(1, !args.quiet);
  FileProgress progress(whole, args.output);
  Result<MergeReport> report = merge_files(batch, files.inputs, files.output, executor, progress);
  if (!report) return report;
  isp::StageClock clock(report->merged.times);
  if (const auto written = write_merged(batch, files.output, *report); !written) {
    return tl::make_unexpected(written.error());
  }
  clock.lap("write");
  return report;
}

void print_report(const DevelopArgs& args, const MergeReport& report) {
  if (!args.quiet) {
    for (const std::string& warning : report.merged.warnings) {
      print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", args.output, warning))));
    }
  }
  if (args.json) return print_out(merge_json(report) + "\n");
  if (args.explain && !args.defaults.items.empty()) {
    print_out(fmt::format("{}\n", one_line("defaults: " + defaults_text(args.defaults))));
  }
  if (args.explain) print_out(merge_text(report));
  if (args.timings) print_out(times_text(report.merged.times));
}

}  // namespace

int run_merge(const std::vector<std::string>& words) {
  const Parsed<DevelopArgs> parsed = parse_merge(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DevelopArgs>(parsed);
  const Result<Files> files = input_files(args);
  if (!files) return print_argument_error("merge", files.error(), args.defaults, object_if(args.json));
  if (const auto free = check_output_path(args.output, args.force); !free) {
    return print_failure(free.error(), object_if(args.json));
  }
  Result<RawBatch> batch = make_batch(args, args.options, {files->output}, files->calibration);
  if (!batch) return print_failure(batch.error(), object_if(args.json));
  const Result<MergeReport> report = merge_and_write(args, *files, *batch);
  if (!report) return print_failure(report.error(), object_if(args.json));
  print_report(args, *report);
  return exit_done;
}

}  // namespace lowlux::cli
