#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/flat_files.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/picture_options.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/cli/verbs.h"
#include "isp/output/picture/image_writer.h"
#include "isp/output/picture/orient.h"
#include "isp/pipeline/develop.h"

namespace lowlux::cli {
namespace {

Result<void> develop_file(const RawBatch& batch, const Job& job, Executor& executor, FileProgress& progress,
                          DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  Result<ReadyFrame> ready = ready_frame(batch, job, executor, clock);
  progress.reach(0.3);
  if (!ready) return tl::make_unexpected(ready.error());
  const RawDn& raw = ready->frame.raw;
  Result<isp::Developed> developed = isp::develop(ready->frame, ready->options, executor);
  if (!developed) return tl::make_unexpected(developed.error());
  out.times.insert(out.times.end(), developed->plan.times.begin(), developed->plan.times.end());
  progress.reach(0.5);
  isp::StageClock finish(out.times);
  const Picture upright = isp::oriented(std::move(developed->picture), raw.info.orientation, executor);
  finish.lap("orientation");
  isp::WriteOptions write = write_options(batch.args);
  write.overwrite = job.overwrite;
  write.sync = batch.sync;
  // The output is written last: if it exists, --skip-existing takes all as done.
  Result<void> maps = write_noise_maps(batch, job, std::move(developed->noise_maps), raw, executor);
  if (!maps) return maps;
  maps = write_seeing_map(batch, job, std::move(developed->seeing_map), raw, executor);
  if (!maps) return maps;
  const Result<void> written = isp::write_picture(upright, batch.options.space, raw.info, job.output, write, executor);
  finish.lap("encode and write");
  if (!written) return fail(written.error().code, written.error().message, job.output);
  std::visit([&](const auto& picture) { out.width = picture.width(), out.height = picture.height(); }, upright);
  out.plan = std::move(developed->plan);
  if (ready->options.denoise.maps && !out.plan->noise_reduction.has_level()) {
    out.plan->warnings.emplace_back("no maps were written: the noise is left as it is");
  }
  return {};
}

}  // namespace

int run_develop(const std::vector<std::string>& words) {
  Parsed<DevelopArgs> parsed = parse_develop(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DevelopArgs>(parsed);

  Result<std::vector<Job>> jobs = plan_outputs(args, "png");
  if (!jobs) return print_argument_error("develop", jobs.error());
  const Result<isp::FileFormat> format = isp::format_of(jobs->front().output);
  if (!format) return print_usage_error("develop", format.error());
  if (!args.format.empty() && !names_folder(args)) {
    return print_usage_error("develop", {ErrorCode::invalid_argument,
                                         "goes with a folder as output; a file's name says its format", "--format"});
  }
  Result<isp::DevelopOptions> options = complete_options(args, *format);
  if (!options) return print_usage_error("develop", options.error());

  const Result<DarkNames> darks = dark_files(args, *jobs);
  if (!darks) return print_argument_error("develop", darks.error());
  const Result<std::vector<std::string>> flats = raw_files_of_lists(args.flats);
  if (!flats) return print_argument_error("develop", flats.error());
  if (const auto apart = check_no_picture(*jobs, *flats, "--flat-frame", "flats"); !apart) {
    return print_argument_error("develop", apart.error());
  }
  std::vector<std::string> only_read = darks->all();
  only_read.insert(only_read.end(), flats->begin(), flats->end());
  only_read.insert(only_read.end(), {args.profile, args.black_profile, args.dark.doubling_profile,
                                     args.look.coefficients, args.look.light_file});
  if (const auto unharmed = check_unharmed(*jobs, only_read); !unharmed)
    return print_usage_error("develop", unharmed.error());

  if (const auto made = make_for_display(args, *options); !made) return print_failure(made.error());
  std::shared_ptr<const calib::FlatField> flat;
  if (!flats->empty()) {
    auto read = read_flats(*flats);
    if (!read) return print_failure(read.error());
    flat = *std::move(read);
  }
  Result<RawBatch> batch = make_batch(args, *options, *std::move(jobs), *darks);
  if (!batch) return print_failure(batch.error());
  batch->flat = std::move(flat);
  return run_batch(*batch, [&](const Job& job, Executor& executor, FileProgress& progress, DevelopOutcome& out) {
    return develop_file(*batch, job, executor, progress, out);
  });
}

}  // namespace lowlux::cli
