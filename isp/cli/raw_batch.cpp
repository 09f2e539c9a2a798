#include "isp/cli/raw_batch.h"

#include <filesystem>
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

constexpr double used_memory = 0.8;  // of what is available: estimates are not exact, and others need some too

/// An existing output is reported before any work is done; the writer of the file checks again.
Result<void> check_free(const std::string& output, isp::Overwrite overwrite) {
  std::error_code ignored;
  if (overwrite == isp::Overwrite::yes || !std::filesystem::exists(output, ignored)) return {};
  return fail(ErrorCode::exists,
              fmt::format("{} exists: use --force to overwrite it, --skip-existing to keep it", output), output);
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
  Result<std::shared_ptr<const DarkFrame>> dark = batch.darks->frame_for(frame);
  if (!dark) return tl::make_unexpected(dark.error());
  options.dark_frame = std::move(*dark);
  options.black = batch.options.black;  // the darks hold it
  return options;
}

}  // namespace

std::vector<std::string> files_of(const RawBatch& batch, const Job& job) {
  std::vector<std::string> files{job.output};
  if (batch.options.denoise.maps) {
    for (std::string& map : noise_map_names(job.output)) files.push_back(std::move(map));
  }
  return files;
}

void FileProgress::reach(double share) {
  whole_.advance(share - reached_, file_);
  reached_ = share;
}

Result<RawBatch> make_batch(const DevelopArgs& args, const isp::DevelopOptions& options, std::vector<Job> jobs,
                            const std::vector<std::string>& darks) {
  RawBatch batch{.args = args, .options = options, .jobs = std::move(jobs)};
  if (const std::string& file = args.profile.empty() ? args.black_profile : args.profile; !file.empty()) {
    auto profile = read_profile(file);
    if (!profile) return tl::make_unexpected(with_file(profile.error(), file));
    batch.profile = std::move(*profile);
  }
  batch.sync = args.sync ? isp::Sync::yes : isp::Sync::no;
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
  if (!darks.empty()) {
    auto source = read_darks(darks, args.dark);
    if (!source) return tl::make_unexpected(source.error());
    batch.darks = *std::move(source);
  }
  if (args.jobs == 0 && batch.jobs.size() > 1) {  // the darks are held by now
    if (const auto bytes = available_memory()) batch.memory = std::make_shared<MemoryGate>(used_memory * *bytes);
  }
  return batch;
}

Result<ReadyFrame> ready_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock) {
  for (const std::string& output : files_of(batch, job)) {
    if (const auto free = check_free(output, job.overwrite); !free) return tl::make_unexpected(free.error());
  }
  Result<RawFrame> frame = capture::read_raw(job.input);
  clock.lap("read and decode");
  if (!frame) return tl::make_unexpected(frame.error());
  Result<isp::DevelopOptions> options = options_for(batch, *frame);
  if (!options) return tl::make_unexpected(options.error());
  if (batch.memory) batch.memory->report_size(batch.bytes_of(frame->raw, *options, executor.width()));
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
    if (Result<void> written = write_map(map, job.overwrite, batch.sync); !written) return written;
  }
  return {};
}

}  // namespace lowlux::cli
