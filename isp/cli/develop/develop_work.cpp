#include "isp/cli/develop/develop_work.h"

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/merge/merge_files.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/picture_options.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/picture/image_writer.h"
#include "isp/output/picture/orient.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/merge/merge_budget.h"

namespace lowlux::cli {
namespace {

/// Leaves the time that merging did not take for developing, at least what was reserved for it.
void subtract_time(const isp::MergePlan& plan, const RawDn& raw, isp::ProcessingGoal& goal) {
  const double reserved_s = isp::developing_reserve_s(*goal.cost, isp::cost_size(raw), *goal.budget_s);
  goal.budget_s = std::max(*goal.budget_s - plan.taken_s, reserved_s);
}

/// Merges frames of one scene, and returns the result as a frame to develop.
Result<ReadyFrame> merged_frame(const RawBatch& batch, const Job& job, const std::vector<std::string>& frames,
                                Executor& executor, FileProgress& progress, DevelopOutcome& out) {
  Result<MergeReport> report = merge_files(batch, frames, job, executor, progress);
  if (!report) return tl::make_unexpected(report.error());
  isp::MergedRaw& merged = report->merged;
  ReadyFrame ready{std::exchange(merged.frame, {}), {}};
  merged.frame.noise = ready.frame.noise;  // the report states it
  ready.options = options_of_merged(batch, ready.frame);
  ready.frame.warnings = merged.warnings;
  set_profile_tables(batch.args, ready);
  ready.merged_exposure_ev = merged.baseline_exposure_ev;
  out.times.insert(out.times.end(), merged.times.begin(), merged.times.end());
  isp::StageClock clock(out.times);
  if (const auto set = set_cost(batch, ready.options, executor, clock); !set) return tl::make_unexpected(set.error());
  if (merged.plan) subtract_time(*merged.plan, ready.frame.raw, *ready.options.effects);
  out.merged = *std::move(report);
  return ready;
}

/// Removes later lines that are equal to earlier ones: the merged frame can have the faults of its frames.
void remove_repeats(std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines.erase(std::remove(lines.begin() + static_cast<std::ptrdiff_t>(i) + 1, lines.end(), lines[i]), lines.end());
  }
}

/// Adds BaselineExposure to an exposure that was given, for images for viewing. The automatic one measures the
/// image itself, and linear spaces are for measurement.
void add_baseline_exposure(const DevelopArgs& args, ReadyFrame& ready) {
  if (!args.baseline_exposure || !ready.options.exposure_ev || is_linear(ready.options.space)) return;
  const double source_ev = ready.frame.source_tags ? ready.frame.source_tags->baseline_exposure_ev : 0;
  const double ev = *ready.options.exposure_ev + source_ev + ready.merged_exposure_ev;
  ready.options.exposure_ev = std::clamp(ev, -max_exposure_ev, max_exposure_ev);
}

/// Writes the output of a job and its maps, all or none.
/// @param prepare  writes the output to a file without its name
template <class Prepare>
Result<void> write_with_maps(const RawBatch& batch, const Job& job, const std::vector<PixelMap>& maps,
                             const Prepare& prepare) {
  auto files = prepare_maps(maps, job.overwrite, batch.sync);
  if (!files) return tl::make_unexpected(files.error());
  Result<isp::AtomicFile> output = prepare();
  if (!output) return tl::make_unexpected(output.error());
  files->push_back(*std::move(output));
  return isp::AtomicFile::commit_all(*files);
}

std::string description_of(const isp::NoiseReduction& how, const std::optional<NoiseOrigin>& origin) {
  return fmt::format("noise reduced by lowlux, level {}, noise model: {}", denoise::name_of(*how.level),
                     origin ? title_of(origin->source) : name_of(how.source));
}

/// Describes the clean raw of a frame.
std::string clean_raw_text(const RawDn& from) {
  const char* const samples = from.is_float() && !from.from_x_trans ? "32-bit floats" : "16 bits";
  if (from.from_x_trans) {
    return fmt::format("LinearRaw DNG of three colours, {}: X-Trans is interpolated when it is read", samples);
  }
  if (from.layout == SensorLayout::linear_rgb) return fmt::format("LinearRaw DNG of three colours, {}", samples);
  return fmt::format("DNG of a {}, {}", from.layout == SensorLayout::bayer ? "mosaic" : "monochrome sensor", samples);
}

}  // namespace

Result<DevelopedFrame> develop_frame(const RawBatch& batch, const Job& job,
                                     const std::optional<std::vector<std::string>>& frames, Executor& executor,
                                     FileProgress& progress, DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  Result<ReadyFrame> ready =
      frames ? merged_frame(batch, job, *frames, executor, progress, out) : ready_frame(batch, job, executor, clock);
  progress.reach(0.3);
  if (!ready) return tl::make_unexpected(ready.error());
  add_baseline_exposure(batch.args, *ready);
  const RawDn& raw = ready->frame.raw;
  Result<isp::Developed> developed = isp::develop(ready->frame, ready->options, executor);
  if (!developed) return tl::make_unexpected(developed.error());
  out.times.insert(out.times.end(), developed->plan.times.begin(), developed->plan.times.end());
  progress.reach(0.5);
  isp::StageClock finish(out.times);
  DevelopedFrame made{isp::oriented(std::move(developed->picture), raw.info.orientation, executor),
                      raw.info,
                      {},
                      ready->frame.source_tags};
  finish.lap("orientation");
  made.maps = noise_map_files(std::move(developed->noise_maps), raw, job.output, executor);
  if (developed->seeing_map.size() > 0) {
    made.maps.push_back(seeing_map_file(std::move(developed->seeing_map), raw, job.output, executor));
  }
  std::visit([&](const auto& picture) { out.width = picture.width(), out.height = picture.height(); }, made.picture);
  out.plan = std::move(developed->plan);
  out.noise = std::move(ready->noise);
  if (frames) remove_repeats(out.plan->warnings);
  if (ready->options.denoise.maps && !out.plan->noise_reduction.has_level()) {
    out.plan->warnings.emplace_back("no maps were written: noise is not reduced");
  }
  return made;
}

Result<void> write_developed(const RawBatch& batch, const Job& job, const DevelopedFrame& developed, Executor& executor,
                             DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  isp::WriteOptions write = write_options(batch.args);
  write.overwrite = job.overwrite;
  write.sync = batch.sync;
  write.source_tags = developed.source_tags;
  const Picture& picture = developed.picture;
  const OutputSpace space = batch.options.space;
  const auto written =
      is_standard_stream(job.output)
          ? format_of_output(batch.args, job.output).and_then([&](isp::FileFormat format) {
              return isp::write_picture(picture, space, developed.info, format, STDOUT_FILENO, write, executor);
            })
          : write_with_maps(batch, job, developed.maps, [&] {
              return isp::prepare_picture(picture, space, developed.info, job.output, write, executor);
            });
  clock.lap("encode and write");
  return written.map_error([&](Error error) { return with_file(std::move(error), job.output); });
}

isp::DevelopOptions without_rendering(isp::DevelopOptions o) {
  o.space = OutputSpace::camera;
  o.samples = SampleType::f32;
  o.tone = isp::ToneCurve::none;
  o.exposure_ev = 0;
  o.denoise.always = true;
  return o;
}

Result<DenoisedFrame> denoise_frame(const RawBatch& batch, const Job& job, Executor& executor, FileProgress& progress,
                                    DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  Result<ReadyFrame> ready = ready_frame(batch, job, executor, clock);
  progress.reach(0.2);
  if (!ready) return tl::make_unexpected(ready.error());
  Result<isp::CleanRaw> clean = isp::clean_raw(ready->frame, ready->options, executor);
  if (!clean) return tl::make_unexpected(clean.error());
  out.times.insert(out.times.end(), clean->plan.times.begin(), clean->plan.times.end());
  progress.reach(0.8);
  DenoisedFrame made{std::move(clean->frame), {}, description_of(clean->plan.noise_reduction, ready->noise)};
  made.maps = noise_map_files(std::move(clean->maps), ready->frame.raw, job.output, executor);
  out.width = made.frame.raw.default_crop.width;
  out.height = made.frame.raw.default_crop.height;
  out.clean_raw = clean_raw_text(ready->frame.raw);
  out.plan = std::move(clean->plan);
  out.noise = std::move(ready->noise);
  return made;
}

Result<void> write_denoised(const RawBatch& batch, const Job& job, const DenoisedFrame& denoised, DevelopOutcome& out) {
  isp::StageClock clock(out.times);
  const isp::DngWriteOptions options{.overwrite = job.overwrite,
                                     .software = "lowlux " + version_number(),
                                     .description = denoised.description,
                                     .sync = batch.sync,
                                     .compression = batch.args.compression};
  const auto written = is_standard_stream(job.output) ? isp::write_dng(denoised.frame, STDOUT_FILENO, options)
                                                      : write_with_maps(batch, job, denoised.maps, [&] {
                                                          return isp::prepare_dng(denoised.frame, job.output, options);
                                                        });
  clock.lap("write");
  return written.map_error([&](Error error) { return with_file(std::move(error), job.output); });
}

}  // namespace lowlux::cli
