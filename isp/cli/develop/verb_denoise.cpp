#include <utility>

#include "isp/base/file_extension.h"
#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/develop_work.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/cli/verbs.h"
#include "isp/pipeline/finished/clean_raw.h"

namespace lowlux::cli {

int run_denoise(const std::vector<std::string>& words) {
  Parsed<DevelopArgs> parsed = parse_denoise(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DevelopArgs>(parsed);
  const FailureJson json = is_standard_stream(args.output) ? FailureJson::none : array_if(args.json);

  Result<std::vector<Job>> jobs = plan_outputs(args, "dng");
  if (!jobs) return print_argument_error("denoise", jobs.error(), args.defaults, json);
  if (!has_extension(jobs->front().output, ".dng") && !is_standard_stream(jobs->front().output)) {
    return print_usage_error(
        "denoise",
        {ErrorCode::invalid_argument, "denoised raw files are written as DNG: the name must end with .dng", "-o"},
        json);
  }
  const Result<CalibrationFiles> calibration = calibration_files(args, *jobs);
  if (!calibration) return print_argument_error("denoise", calibration.error(), args.defaults, json);
  Result<RawBatch> batch = make_batch(args, without_rendering(args.options), *std::move(jobs), *calibration);
  if (!batch) return print_failure(batch.error(), json);
  batch->bytes_of = isp::clean_raw_bytes;
  return run_batch(*batch, [&](const Job& job, Executor& executor, FileProgress& progress, DevelopOutcome& out) {
    return denoise_frame(*batch, job, executor, progress, out).and_then([&](const DenoisedFrame& denoised) {
      return write_denoised(*batch, job, denoised, out);
    });
  });
}

}  // namespace lowlux::cli
