#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/develop_work.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/merge/merge_files.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/cli/verbs.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

/// Returns a job for each frame that is merged to the output of one.
std::vector<Job> jobs_of(const std::vector<std::string>& frames, const std::vector<Job>& output) {
  std::vector<Job> jobs;
  for (const std::string& frame : frames) jobs.push_back({frame, output.front().output, output.front().overwrite});
  return jobs;
}

}  // namespace

int run_develop(const std::vector<std::string>& words) {
  Parsed<DevelopArgs> parsed = parse_develop(words, options_contradict);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  auto& args = std::get<DevelopArgs>(parsed);
  const FailureJson json = is_standard_stream(args.output) ? FailureJson::none : array_if(args.json);

  std::optional<std::vector<std::string>> frames;
  if (args.merge) {
    Result<std::vector<std::string>> files = files_to_merge(args);
    if (!files) return print_argument_error("develop", files.error(), args.defaults, json);
    frames = *std::move(files);
    args.inputs = {frames->front()};
    args.merging.options.developed_after = true;
  }
  Result<std::vector<Job>> jobs = plan_outputs(args, "png");
  if (!jobs) return print_argument_error("develop", jobs.error(), args.defaults, json);
  const Result<isp::FileFormat> format = format_of_output(args, jobs->front().output);
  if (!format) return print_usage_error("develop", format.error(), json, args.defaults);
  const bool is_named = !names_folder(args) && !is_standard_stream(args.output);
  if (!args.format.empty() && is_named && !args.defaults.sets("--format")) {
    return print_usage_error("develop",
                             {ErrorCode::invalid_argument,
                              "requires a folder or - as output; the name of a file states its format", "--format"},
                             json);
  }
  Result<isp::DevelopOptions> options = complete_options(args, *format);
  if (!options) return print_usage_error("develop", options.error(), json, args.defaults);

  const Result<CalibrationFiles> calibration = calibration_files(args, frames ? jobs_of(*frames, *jobs) : *jobs);
  if (!calibration) return print_argument_error("develop", calibration.error(), args.defaults, json);
  Result<RawBatch> batch = make_batch(args, *std::move(options), *std::move(jobs), *calibration);
  if (!batch) return print_failure(batch.error(), json);
  return run_batch(*batch, [&](const Job& job, Executor& executor, FileProgress& progress, DevelopOutcome& out) {
    return develop_frame(*batch, job, frames, executor, progress, out).and_then([&](const DevelopedFrame& developed) {
      return write_developed(*batch, job, developed, executor, out);
    });
  });
}

}  // namespace lowlux::cli
