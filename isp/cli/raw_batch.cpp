#include "isp/cli/raw_batch.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "isp/cli/exit_code.h"
#include "isp/cli/noise_maps.h"
#include "isp/cli/noise_source.h"
#include "isp/cli/profile_file.h"
#include "isp/cli/profile_option.h"

namespace lowlux::cli {
namespace {

Error with_place(Error error, const std::string& where) {
  if (error.where.empty()) error.where = where;
  return error;
}

/// An existing output is known to be in the way before any work is done; whoever writes it looks again.
Result<void> check_free(const std::string& output, bool force) {
  std::error_code ignored;
  if (force || !std::filesystem::exists(output, ignored)) return {};
  return fail(ErrorCode::exists, fmt::format("{} exists: use --force to overwrite it", output), output);
}

/// What holds for one frame: profile and darks; what the profile says goes into the frame.
Result<isp::DevelopOptions> options_for(const RawBatch& batch, RawFrame& frame) {
  isp::DevelopOptions options = batch.options;
  options.effects = batch.args.effects.effects;
  if (options.effects) options.effects->cost = batch.kept_cost;
  if (batch.speed) {
    const Rect& crop = frame.raw.default_crop;
    options.effects->budget_s = budget_s(batch.args.effects, 1e-6 * crop.width * crop.height);
  }
  if (batch.profile) {
    const ProfileChoice choice{!batch.args.profile.empty(), batch.args.gain_setting};
    const auto used = use_profile(*batch.profile, choice, frame, options);
    if (!used) return tl::make_unexpected(used.error());
  }
  if (!batch.darks) return options;
  Result<std::shared_ptr<const DarkFrame>> dark = dark_frame_of(*batch.darks, frame.raw);
  if (!dark) return tl::make_unexpected(dark.error());
  options.dark_frame = std::move(*dark);
  options.black = batch.options.black;  // the darks hold it
  return options;
}

void print_outcome(const DevelopArgs& args, const DevelopOutcome& outcome) {
  if (outcome.error) {
    print_err("{}\n", error_line(outcome.input, *outcome.error));
    return;
  }
  if (!args.quiet) {
    for (const std::string& warning : outcome.plan->warnings) {
      print_err("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", outcome.input, warning)));
    }
  }
  if (args.json) return;
  if (args.explain) print_out("{}\n{}", outcome.input, explain_text(*outcome.plan));
  if (args.timings) print_out("{}\n{}", outcome.input, times_text(outcome.times));
}

DevelopOutcome outcome_of(const Job& job, const RawWork& work, Executor& executor, Progress& progress) {
  DevelopOutcome out{job.input, job.output};
  FileProgress done(progress, job.input);
  try {
    const Result<void> worked = work(job, executor, done, out);
    if (!worked) out.error = with_place(worked.error(), job.input);
  } catch (const std::bad_alloc&) {
    out.error = Error{ErrorCode::too_large, "not enough memory; --jobs 1 takes the least", job.input};
  } catch (const std::exception& failure) {
    out.error = Error{ErrorCode::too_large, failure.what(), job.input};
  }
  return out;
}

/// Each worker takes the next file: while one reads, another renders or encodes.
std::vector<DevelopOutcome> run_all(const RawBatch& batch, const RawWork& work) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int files = static_cast<int>(batch.jobs.size());
  const int workers = batch.speed ? 1 : std::min(files, batch.args.jobs > 0 ? batch.args.jobs : processors);
  std::vector<DevelopOutcome> outcomes(batch.jobs.size());
  std::atomic<int> next{0};
  Progress progress(files, !batch.args.quiet);
  const auto worker = [&] {
    PoolExecutor executor(threads_of_each(workers));
    for (int i = next++; i < files; i = next++) {
      outcomes[i] = outcome_of(batch.jobs[i], work, executor, progress);
      progress.print([&] { print_outcome(batch.args, outcomes[i]); });
    }
  };
  {
    std::vector<std::jthread> threads;
    threads.reserve(workers);
    for (int i = 1; i < workers; ++i) threads.emplace_back(worker);
    worker();
  }
  return outcomes;
}

}  // namespace

void FileProgress::reach(double share) {
  whole_.advance(share - reached_, file_);
  reached_ = share;
}

Result<RawBatch> make_batch(const DevelopArgs& args, const isp::DevelopOptions& options, std::vector<Job> jobs,
                            const std::vector<std::string>& darks) {
  RawBatch batch{args, options, std::move(jobs), std::nullopt, std::nullopt, isp::Overwrite::no, nullptr, nullptr};
  if (const std::string& file = args.profile.empty() ? args.black_profile : args.profile; !file.empty()) {
    auto profile = read_profile(file);
    if (!profile) return tl::make_unexpected(with_place(profile.error(), file));
    batch.profile = std::move(*profile);
  }
  batch.overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  if (args.output.ends_with('/')) {
    std::error_code error;
    std::filesystem::create_directories(args.output, error);
    if (error) return fail(ErrorCode::unwritable, "the folder cannot be made: " + error.message(), args.output);
  }
  if (args.effects.budgeted()) {
    batch.speed = std::make_shared<MachineSpeed>(cost_of_this_machine(threads_of_each(1), args.quiet));
  } else if (args.effects.effects && (args.explain || args.json)) {
    if (auto cost = kept_cost(threads_of_each(1))) {
      batch.kept_cost = std::make_shared<const isp::CostModel>(*std::move(cost));
    }
  }
  if (darks.empty()) return batch;
  Result<DarkSource> source = read_darks(darks, args.dark);
  if (!source) return tl::make_unexpected(source.error());
  batch.darks = *std::move(source);
  return batch;
}

Result<ReadyFrame> ready_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock) {
  std::vector<std::string> outputs{job.output};
  if (batch.options.denoise.maps) {
    for (std::string& map : noise_map_names(job.output)) outputs.push_back(std::move(map));
  }
  for (const std::string& output : outputs) {
    if (const auto free = check_free(output, batch.args.force); !free) return tl::make_unexpected(free.error());
  }
  Result<RawFrame> frame = capture::read_raw(job.input);
  clock.lap("read and decode");
  if (!frame) return tl::make_unexpected(frame.error());
  Result<isp::DevelopOptions> options = options_for(batch, *frame);
  if (!options) return tl::make_unexpected(options.error());
  if (batch.darks) clock.lap("dark frame's making");
  if (const Result<void> found = find_noise(*options, *frame, executor); !found) {
    return tl::make_unexpected(found.error());
  }
  if (frame->noise && frame->noise->source == NoiseProfile::Source::picture) clock.lap("noise of the picture");
  if (batch.speed) {
    auto cost = batch.speed->now(executor);
    if (!cost) return tl::make_unexpected(cost.error());
    options->effects->cost = *std::move(cost);
    clock.lap("machine's pace");
  }
  return ReadyFrame{*std::move(frame), *std::move(options)};
}

Result<void> write_noise_maps(const RawBatch& batch, const Job& job, isp::NoiseMaps maps, const RawDn& raw,
                              Executor& executor) {
  for (const PixelMap& map : noise_map_files(std::move(maps), raw, job.output, executor)) {
    if (Result<void> written = write_map(map, batch.overwrite); !written) return written;
  }
  return {};
}

int run_batch(const RawBatch& batch, const RawWork& work) {
  const std::vector<DevelopOutcome> outcomes = run_all(batch, work);
  const auto failed = std::ranges::count_if(outcomes, [](const auto& o) { return o.error.has_value(); });
  if (batch.args.json) {
    std::string json;
    for (const DevelopOutcome& outcome : outcomes) {
      if (!json.empty()) json += ",\n";
      json += develop_json(outcome);
    }
    print_out("[{}]\n", json);
  }
  if (failed > 0 && outcomes.size() > 1) {
    print_err("lowlux: {} of {} files failed\n", failed, outcomes.size());
  }
  return failed > 0 ? exit_failed : exit_done;
}

}  // namespace lowlux::cli
