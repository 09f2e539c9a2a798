#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/explain_text.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/verbs.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/pipeline/finished/clean_raw.h"

namespace lowlux::cli {
namespace {

std::string description_of(const isp::NoiseReduction& how) {
  return fmt::format("noise reduced by lowlux, level {}, noise from the {}", denoise::name_of(*how.level),
                     name_of(how.source));
}

Result<void> denoise_file(const RawBatch& batch, const Job& job, Executor& executor, FileProgress& progress,
                          DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  Result<ReadyFrame> ready = ready_frame(batch, job, executor, clock);
  progress.reach(0.2);
  if (!ready) return tl::make_unexpected(ready.error());
  Result<isp::CleanRaw> clean = isp::clean_raw(ready->frame, ready->options, executor);
  if (!clean) return tl::make_unexpected(clean.error());
  out.times.insert(out.times.end(), clean->plan.times.begin(), clean->plan.times.end());
  progress.reach(0.8);
  isp::StageClock finish(out.times);
  Result<void> maps = write_noise_maps(batch, job, std::move(clean->maps), ready->frame.raw, executor);
  if (!maps) return maps;
  const Result<void> written = isp::write_dng(clean->frame, job.output,
                                              {.overwrite = job.overwrite,
                                               .software = "lowlux " + version_number(),
                                               .description = description_of(clean->plan.noise_reduction),
                                               .sync = batch.sync});
  finish.lap("write");
  if (!written) return fail(written.error().code, written.error().message, job.output);
  out.width = clean->frame.raw.default_crop.width;
  out.height = clean->frame.raw.default_crop.height;
  out.plan = std::move(clean->plan);
  return {};
}

/// Returns the memory of `denoise`: the maps are always made, and codes take the place of an image.
std::size_t clean_raw_bytes(const RawDn& raw, const isp::DevelopOptions& options, int threads) {
  isp::DevelopOptions with_maps = options;
  with_maps.denoise.maps = true;
  return isp::expected_bytes(raw, with_maps, threads);
}

/// Removes rendering: a plan's decisions on colour and tone are not used.
isp::DevelopOptions without_rendering(isp::DevelopOptions o) {
  o.space = OutputSpace::camera;
  o.samples = SampleType::f32;
  o.tone = isp::ToneCurve::none;
  o.exposure_ev = 0;
  o.denoise.always = true;
  return o;
}

}  // namespace

int run_denoise(const std::vector<std::string>& words) {
  Parsed<DevelopArgs> parsed = parse_denoise(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DevelopArgs>(parsed);

  Result<std::vector<Job>> jobs = plan_outputs(args, "dng");
  if (!jobs) return print_argument_error("denoise", jobs.error());
  if (!jobs->front().output.ends_with(".dng")) {
    return print_usage_error("denoise",
                             {ErrorCode::invalid_argument, "a clean raw is a DNG: its name ends with .dng", "-o"});
  }
  const Result<DarkNames> darks = dark_files(args, *jobs);
  if (!darks) return print_argument_error("denoise", darks.error());
  std::vector<std::string> only_read = darks->all();
  only_read.insert(only_read.end(), {args.profile, args.black_profile, args.dark.doubling_profile});
  if (const auto unharmed = check_unharmed(*jobs, only_read); !unharmed)
    return print_usage_error("denoise", unharmed.error());

  Result<RawBatch> batch = make_batch(args, without_rendering(args.options), *std::move(jobs), *darks);
  if (!batch) return print_failure(batch.error());
  batch->bytes_of = clean_raw_bytes;
  return run_batch(*batch, [&](const Job& job, Executor& executor, FileProgress& progress, DevelopOutcome& out) {
    return denoise_file(*batch, job, executor, progress, out);
  });
}

}  // namespace lowlux::cli
