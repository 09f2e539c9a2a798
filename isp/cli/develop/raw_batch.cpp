#include "isp/cli/develop/raw_batch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "isp/cli/develop/batch_report.h"
#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/interruption.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/cli/shared/picture_options.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/raw/subtract_dark_frame.h"

namespace lowlux::cli {
namespace {

constexpr double used_memory = 0.8;  // of the available: estimates are not exact, and others need some too

/// Reports an existing output before any work is done; the writer of the file checks again.
Result<void> check_output_is_free(const std::string& output, isp::Overwrite overwrite) {
  std::error_code ignored;
  if (is_standard_stream(output) || overwrite == isp::Overwrite::yes || !std::filesystem::exists(output, ignored))
    return {};
  return fail(ErrorCode::exists,
              fmt::format("{} exists: use --force to overwrite it, --skip-existing to keep it", output), output);
}

/// Returns the options of one frame: profile and darks; values of the profile are put into the frame.
/// @param without_dark  the dark frame was subtracted when the file was read
Result<isp::DevelopOptions> options_for(const RawBatch& batch, RawFrame& frame, bool without_dark) {
  isp::DevelopOptions options = options_of_goal(batch, frame);
  std::optional<calib::ProfileAtFrame> of_profile;
  if (batch.profile) {
    const ProfileChoice choice{.everything = !batch.args.profile.empty(),
                               .with_darks = batch.darks != nullptr,
                               .gain_setting = batch.args.gain_setting};
    auto used = use_profile(*batch.profile, choice, frame, options);
    if (!used) return tl::make_unexpected(used.error());
    of_profile = *std::move(used);
  }
  if (batch.flat) {
    if (const auto used = use_flat(*batch.flat, frame); !used) return tl::make_unexpected(used.error());
  }
  if (!batch.darks || without_dark) return options;
  Result<std::shared_ptr<const DarkFrame>> dark = batch.darks->frame_for(frame, options.black);
  if (!dark) return tl::make_unexpected(dark.error());
  options.dark_frame = std::move(*dark);
  options.black = batch.options.black;  // the darks include it
  if (of_profile && frame.noise && frame.noise->source == NoiseProfile::Source::profile) {
    const auto level = isp::black_of(frame.raw, *options.dark_frame);
    const auto above = level ? calib::noise_above(*level, *of_profile, frame.raw) : std::nullopt;
    if (above) {
      frame.noise->scale = above->scale;
      frame.noise->offset = above->offset;
    }
  }
  return options;
}

}  // namespace

isp::DevelopOptions options_of_goal(const RawBatch& batch, const RawFrame& frame) {
  isp::DevelopOptions options = batch.options;
  options.effects = batch.args.effects.effects;
  if (options.effects) options.effects->cost = batch.kept_cost;
  if (batch.speed) {
    const Rect& crop = frame.raw.default_crop;
    options.effects->budget_s = budget_s(batch.args.effects, 1e-6 * crop.width * crop.height);
  }
  return options;
}

std::vector<std::string> files_of(const RawBatch& batch, const Job& job) {
  std::vector<std::string> files{job.output};
  if (batch.options.denoise.maps) {
    for (std::string& map : noise_map_names(job.output)) files.push_back(std::move(map));
  }
  if (batch.options.look.seeing_map) files.push_back(seeing_map_name(job.output));
  return files;
}

void FileProgress::reach(double share) {
  whole_.advance(share - reached_, file_);
  reached_ = share;
}

Result<RawFrame> read_file(const std::string& file, const capture::XTransUse& x_trans_use) {
  return is_standard_stream(file) ? read_standard_input(x_trans_use) : capture::read_raw(file, {}, x_trans_use);
}

Result<RawBatch> make_batch(const DevelopArgs& args, isp::DevelopOptions options, std::vector<Job> jobs,
                            const CalibrationFiles& calibration) {
  if (const auto made = make_for_display(args, options); !made) return tl::make_unexpected(made.error());
  args.shard.select(jobs);
  RawBatch batch{.args = args, .options = std::move(options), .jobs = std::move(jobs)};
  if (!calibration.flats.empty()) {
    auto flat = read_flats(calibration.flats);
    if (!flat) return tl::make_unexpected(flat.error());
    batch.flat = *std::move(flat);
  }
  if (const std::string& file = args.profile.empty() ? args.black_profile : args.profile; !file.empty()) {
    auto profile = read_profile(file);
    if (!profile) return tl::make_unexpected(with_file(profile.error(), file));
    batch.profile = std::move(*profile);
  }
  batch.sync = args.sync ? isp::Sync::yes : isp::Sync::no;
  if (args.output.ends_with('/')) {
    std::error_code error;
    std::filesystem::create_directories(args.output, error);
    if (error) return fail(ErrorCode::unwritable, "the folder cannot be created: " + error.message(), args.output);
  }
  if (args.effects.budgeted()) {
    batch.speed = std::make_shared<MachineSpeed>(cost_of_this_machine(threads_of_each(1), args.quiet));
  } else if (args.effects.effects && (args.explain || args.json)) {
    if (auto cost = kept_cost(threads_of_each(1))) {
      batch.kept_cost = std::make_shared<const isp::CostModel>(*std::move(cost));
    }
  }
  if (!calibration.darks.empty()) {
    auto source = read_darks(calibration.darks, args.dark);
    if (!source) return tl::make_unexpected(source.error());
    batch.darks = *std::move(source);
  }
  if (args.jobs == 0 && batch.jobs.size() > 1) {  // the darks are in memory by now
    if (const auto bytes = available_memory()) batch.memory = std::make_shared<MemoryGate>(used_memory * *bytes);
  }
  return batch;
}

Result<ReadyFrame> read_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock) {
  for (const std::string& output : job.output.empty() ? std::vector<std::string>() : files_of(batch, job)) {
    if (const auto free = check_output_is_free(output, job.overwrite); !free) return tl::make_unexpected(free.error());
  }
  bool without_dark = false;
  const auto subtract = [&](RawFrame& mosaic) {
    without_dark = true;
    return subtract_from_x_trans(*batch.darks, batch.options.black, mosaic);
  };
  Result<RawFrame> frame = batch.read(job.input, batch.darks ? capture::XTransUse(subtract) : capture::XTransUse());
  clock.lap("read and decode");
  if (!frame) return tl::make_unexpected(frame.error());
  Result<isp::DevelopOptions> options = options_for(batch, *frame, without_dark);
  if (!options) return tl::make_unexpected(options.error());
  ReadyFrame ready{*std::move(frame), *std::move(options)};
  if (!batch.args.merge) set_profile_tables(batch.args, ready);
  if (batch.memory) {
    const std::size_t flat = batch.flat ? sizeof(float) * batch.flat->gain.gain.size() : 0;
    const std::size_t tags = ready.frame.source_tags ? bytes_of(*ready.frame.source_tags) : 0;
    batch.memory->report_size(flat + tags + batch.bytes_of(ready.frame.raw, ready.options, executor.width()));
  }
  if (batch.darks) clock.lap("dark frame's making");
  return ready;
}

void set_profile_tables(const DevelopArgs& args, ReadyFrame& ready) {
  const CameraColour& colour = ready.frame.colour;
  if (!args.camera_profile || !ready.frame.source_tags || is_linear(ready.options.space) ||
      ready.options.look.look != isp::Look::camera || colour.source != CameraColour::Source::file_tags) {
    return;
  }
  const bool uses_curve = !args.tone && ready.options.tone_shape == isp::ToneShape{};
  ready.options.profile_tables = isp::read_profile_tables(
      *ready.frame.source_tags, {colour.calibrations.size() == 2, uses_curve}, ready.frame.warnings);
}

Result<ReadyFrame> ready_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock) {
  Result<ReadyFrame> ready = read_frame(batch, job, executor, clock);
  if (!ready) return ready;
  auto origin = find_noise(ready->options, batch.args.noise, ready->frame, executor);
  if (!origin) return tl::make_unexpected(origin.error());
  ready->noise = *std::move(origin);
  const auto& noise = ready->frame.noise;
  if (noise && noise->source == NoiseProfile::Source::picture) clock.lap("noise of the image");
  if (const auto set = set_cost(batch, ready->options, executor, clock); !set) return tl::make_unexpected(set.error());
  return ready;
}

Result<void> set_cost(const RawBatch& batch, isp::DevelopOptions& options, Executor& executor, isp::StageClock& clock) {
  if (!batch.speed) return {};
  auto cost = batch.speed->now(executor);
  if (!cost) return tl::make_unexpected(cost.error());
  options.effects->cost = *std::move(cost);
  clock.lap("machine's pace");
  return {};
}

namespace {

/// Processes all files. Of a finished file only counts and the text to be printed at the end are kept: memory does not
/// grow with the number of files.
class BatchRun {
 public:
  BatchRun(const RawBatch& batch, const RawWork& work)
      : batch_(batch),
        work_(work),
        files_(static_cast<int>(batch.jobs.size())),
        progress_(files_, !batch.args.quiet),
        json_(batch.args.json ? batch.jobs.size() : 0) {}

  int run() {
    std::optional<InterruptionReport> interruption;
    if (!batch_.args.quiet) interruption.emplace([this] { return interruption_text(); });
    print_defaults(batch_.args);
    work_on_all();
    print_summary();
    return failed_ > 0 || reports_lost_ ? exit_failed : exit_done;
  }

 private:
  int worker_count() const {
    const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    return batch_.speed ? 1 : std::min(files_, batch_.args.jobs > 0 ? batch_.args.jobs : processors);
  }

  void work_on_all() {
    const int workers = worker_count();
    std::vector<std::jthread> threads;
    threads.reserve(workers);
    try {
      for (int i = 1; i < workers; ++i) threads.emplace_back([this, workers] { take_files(workers); });
    } catch (const std::system_error&) {
      // If the system refuses more threads, the existing ones do the work.
    }
    take_files(workers);
  }

  /// Lets each worker take the next file: while one reads, another renders or encodes. If fewer files fit in memory
  /// than there are workers, each file gets more processors.
  void take_files(int workers) {
    std::optional<PoolExecutor> executor;
    for (int i = next_++; i < files_; i = next_++) {
      const MemoryGate::Entry entry(batch_.memory.get());
      const int threads = threads_of_each(batch_.memory ? batch_.memory->parallel_files(workers) : workers);
      if (!executor || executor->width() != threads) executor.emplace(threads);
      finish(i, outcome_of(batch_.jobs[i], *executor));
    }
  }

  DevelopOutcome outcome_of(const Job& job, Executor& executor) {
    DevelopOutcome out{job.input, job.output};
    out.flat = batch_.flat;
    FileProgress progress(progress_, job.input);
    try {
      Job own = job;
      if (batch_.args.force) own.overwrite = isp::Overwrite::yes;
      if (batch_.args.skip_existing) {
        // The output is written last: if it exists, the maps do too, and maps without it are from an interrupted run.
        // An empty file is the name that such a run had reserved (see publish.h).
        std::error_code absent;
        out.skipped = !is_standard_stream(job.output) && std::filesystem::file_size(job.output, absent) > 0 && !absent;
        if (out.skipped) return out;
        const auto exists = [&absent](const std::string& file) { return std::filesystem::exists(file, absent); };
        if (std::ranges::any_of(files_of(batch_, job), exists)) own.overwrite = isp::Overwrite::yes;
      }
      const Result<void> worked = work_(own, executor, progress, out);
      if (!worked) out.error = with_file(worked.error(), job.input);
    } catch (const std::bad_alloc&) {
      out.error = Error{ErrorCode::too_large, "not enough memory; --jobs 1 needs least memory", job.input};
    } catch (const std::exception& failure) {
      out.error = Error{ErrorCode::too_large, failure.what(), job.input};
    }
    if (out.error && out.error->code == ErrorCode::exists && batch_.args.skip_existing) {  // another run wrote it first
      out.error.reset();
      out.plan.reset();
      out.skipped = true;
    }
    return out;
  }

  void finish(int index, const DevelopOutcome& outcome) {
    ++(outcome.error ? failed_ : outcome.skipped ? skipped_ : done_);
    try {
      if (batch_.args.json) json_[static_cast<std::size_t>(index)] = develop_json(outcome, batch_.args.defaults);
      progress_.print([&] { print_outcome(batch_.args, outcome); });
    } catch (const std::bad_alloc&) {
      print_err("lowlux: not enough memory to print the report\n");
      reports_lost_ = true;
    }
  }

  void print_summary() const {
    if (batch_.args.json) print_out(fmt::format("[{}]\n", fmt::join(json_, ",\n")));
    const bool chatty = batch_.args.explain || batch_.args.timings;
    if (batch_.memory && chatty && !batch_.args.json) {
      if (const auto text = batch_.memory->limit_text()) print_out(fmt::format("{} files: {}\n", files_, *text));
    }
    print_counts(batch_.args, {files_, done_, skipped_, failed_}, std::chrono::steady_clock::now() - begin_);
  }

  std::string interruption_text() const {
    const char* const advice = batch_.args.force || files_ == 1 ? "" : "; run again with --skip-existing";
    return fmt::format("{} of {} files done{}", done_ + skipped_, files_, advice);
  }

  const RawBatch& batch_;
  const RawWork& work_;
  int files_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  Progress progress_;
  std::vector<std::string> json_;  // in the order of the files
  std::atomic<int> next_{0};
  std::atomic<int> done_{0};
  std::atomic<int> skipped_{0};
  std::atomic<int> failed_{0};
  std::atomic<bool> reports_lost_{false};
};

}  // namespace

int run_batch(const RawBatch& batch, const RawWork& work) { return BatchRun(batch, work).run(); }

}  // namespace lowlux::cli
