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
#include "isp/base/executor.h"
#include "isp/cli/args.h"
#include "isp/cli/dark_files.h"
#include "isp/cli/exit_code.h"
#include "isp/cli/noise_maps.h"
#include "isp/cli/noise_source.h"
#include "isp/cli/outputs.h"
#include "isp/cli/profile_file.h"
#include "isp/cli/profile_option.h"
#include "isp/cli/progress.h"
#include "isp/cli/report.h"
#include "isp/cli/verbs.h"
#include "isp/cli/version.h"
#include "isp/output/orient.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {
namespace {

struct Task {
  const DevelopArgs& args;
  isp::DevelopOptions options;
  isp::WriteOptions write;
  std::vector<Job> jobs;
  std::optional<CameraProfile> profile;
  std::optional<DarkSource> darks;
};

Error with_place(Error error, const std::string& where) {
  if (error.where.empty()) error.where = where;
  return error;
}

// An existing output is known to be in the way before any work is done; write_picture looks again.
std::optional<Error> in_the_way(const std::string& output, bool force) {
  std::error_code ignored;
  if (force || !std::filesystem::exists(output, ignored)) return std::nullopt;
  return Error{ErrorCode::exists, fmt::format("{} exists: use --force to overwrite it", output), output};
}

// One file's part of the progress bar: roughly how much of its time is over, all of it in the end.
class FileProgress {
 public:
  FileProgress(Progress& whole, const std::string& file) : whole_(whole), file_(file) {}
  ~FileProgress() { reach(1); }
  FileProgress(const FileProgress&) = delete;
  FileProgress& operator=(const FileProgress&) = delete;
  void reach(double share) {
    whole_.advance(share - reached_, file_);
    reached_ = share;
  }

 private:
  Progress& whole_;
  const std::string& file_;
  double reached_ = 0;
};

// What holds for one frame: profile and darks; what the profile says goes into the frame.
Result<isp::DevelopOptions> options_for(const Task& task, RawFrame& frame) {
  isp::DevelopOptions options = task.options;
  if (task.profile) {
    const bool everything = !task.args.profile.empty();
    const auto used = use_profile(*task.profile, everything, frame, options.black);
    if (!used) return tl::make_unexpected(used.error());
  }
  if (!task.darks) return options;
  Result<std::shared_ptr<const DarkFrame>> dark = dark_frame_of(*task.darks, frame.raw);
  if (!dark) return tl::make_unexpected(dark.error());
  options.dark_frame = std::move(*dark);
  options.black = task.options.black;  // the darks hold it
  return options;
}

DevelopOutcome develop_file(const Task& task, const Job& job, Executor& executor, Progress& progress) {
  DevelopOutcome out{job.input, job.output};
  FileProgress done(progress, job.input);
  isp::StageClock clock(out.times);
  if ((out.error = in_the_way(job.output, task.args.force))) return out;
  if (task.options.denoise.maps) {
    for (const std::string& map : noise_map_names(job.output)) {
      if ((out.error = in_the_way(map, task.args.force))) return out;
    }
  }
  Result<RawFrame> frame = capture::read_raw(job.input);
  clock.lap("read and decode");
  done.reach(0.3);
  if (!frame) {
    out.error = with_place(frame.error(), job.input);
    return out;
  }
  const Result<isp::DevelopOptions> options = options_for(task, *frame);
  if (!options) {
    out.error = with_place(options.error(), job.input);
    return out;
  }
  if (task.darks) clock.lap("dark frame's making");
  if (const Result<void> found = find_noise(*options, *frame, executor); !found) {
    out.error = with_place(found.error(), job.input);
    return out;
  }
  if (frame->noise && frame->noise->source == NoiseProfile::Source::picture) clock.lap("noise of the picture");
  Result<isp::Developed> developed = isp::develop(*frame, *options, executor);
  if (!developed) {
    out.error = with_place(developed.error(), job.input);
    return out;
  }
  out.times.insert(out.times.end(), developed->plan.times.begin(), developed->plan.times.end());
  done.reach(0.5);
  isp::StageClock finish(out.times);
  const Picture upright = isp::oriented(std::move(developed->picture), frame->raw.info.orientation, executor);
  finish.lap("orientation");
  Result<void> written =
      isp::write_picture(upright, task.options.space, frame->raw.info, job.output, task.write, executor);
  finish.lap("encode and write");
  for (const PixelMap& map : noise_map_files(std::move(developed->noise_maps), frame->raw, job.output, executor)) {
    if (written) written = write_map(map, task.write.overwrite);
  }
  if (!written) {
    out.error = with_place(written.error(), job.output);
    return out;
  }
  std::visit([&](const auto& picture) { out.width = picture.width(), out.height = picture.height(); }, upright);
  out.plan = std::move(developed->plan);
  return out;
}

void print_outcome(const Task& task, const DevelopOutcome& outcome) {
  if (outcome.error) {
    fmt::print(stderr, "{}\n", error_line(outcome.input, *outcome.error));
    return;
  }
  if (!task.args.quiet) {
    for (const std::string& warning : outcome.plan->warnings) {
      fmt::print(stderr, "{}\n", one_line(fmt::format("lowlux: {}: warning: {}", outcome.input, warning)));
    }
  }
  if (task.args.explain && !task.args.json) fmt::print("{}\n{}", outcome.input, explain_text(*outcome.plan));
  if (task.args.timings && !task.args.json) fmt::print("{}\n{}", outcome.input, times_text(outcome.times));
}

DevelopOutcome failed(const Job& job, const std::string& why) {
  DevelopOutcome out{job.input, job.output};
  out.error = Error{ErrorCode::too_large, why, job.input};
  return out;
}

// Each worker takes the next file: while one reads, another renders or encodes.
std::vector<DevelopOutcome> develop_all(const Task& task) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int files = static_cast<int>(task.jobs.size());
  const int workers = std::min(files, task.args.jobs > 0 ? task.args.jobs : processors);
  std::vector<DevelopOutcome> outcomes(task.jobs.size());
  std::atomic<int> next{0};
  Progress progress(files, !task.args.quiet);
  const auto work = [&] {
    PoolExecutor executor(std::clamp(processors / workers, 1, 8));
    for (int i = next++; i < files; i = next++) {
      try {
        outcomes[i] = develop_file(task, task.jobs[i], executor, progress);
      } catch (const std::bad_alloc&) {
        outcomes[i] = failed(task.jobs[i], "not enough memory; --jobs 1 takes the least");
      } catch (const std::exception& failure) {
        outcomes[i] = failed(task.jobs[i], failure.what());
      }
      progress.print([&] { print_outcome(task, outcomes[i]); });
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 1; i < workers; ++i) threads.emplace_back(work);
    work();
  }
  return outcomes;
}

int usage_error(const Error& error) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  fmt::print(stderr, "{}\n", one_line("lowlux develop: " + place + error.message));
  return exit_usage;
}

int summarise(const Task& task, const std::vector<DevelopOutcome>& outcomes) {
  const auto failed =
      std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.error.has_value(); });
  if (task.args.json) {
    std::string json;
    for (const DevelopOutcome& outcome : outcomes) json += (json.empty() ? "" : ",\n") + develop_json(outcome);
    fmt::print("[{}]\n", json);
  }
  if (failed > 0 && outcomes.size() > 1) {
    fmt::print(stderr, "lowlux: {} of {} files failed\n", failed, outcomes.size());
  }
  return failed > 0 ? exit_failed : exit_done;
}

// What all files share: profile, darks, and how pictures are written. Errors name their file.
Result<void> prepare(const std::vector<std::string>& darks, Task& task) {
  const DevelopArgs& args = task.args;
  if (const std::string& file = args.profile.empty() ? args.black_profile : args.profile; !file.empty()) {
    auto profile = read_profile(file);
    if (!profile) return tl::make_unexpected(with_place(profile.error(), file));
    task.profile = std::move(*profile);
  }
  task.write.overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  task.write.software = "lowlux " + version_number();
  task.write.jpeg.quality = args.jpeg_quality;
  task.write.exr.depth = args.bits.value_or(16) == 16 ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
  if (args.output.ends_with('/')) {
    std::error_code error;
    std::filesystem::create_directories(args.output, error);
    if (error) return fail(ErrorCode::unwritable, "the folder cannot be made: " + error.message(), args.output);
  }
  if (darks.empty()) return {};
  Result<DarkSource> source = read_darks(darks, args.dark);
  if (!source) return tl::make_unexpected(source.error());
  task.darks = *std::move(source);
  return {};
}

}  // namespace

int run_develop(const std::vector<std::string>& words) {
  Parsed<DevelopArgs> parsed = parse_develop(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DevelopArgs>(parsed);

  Result<std::vector<Job>> jobs = plan_outputs(args);
  if (!jobs) return usage_error(jobs.error());
  const Result<isp::FileFormat> format = isp::format_of(jobs->front().output);
  if (!format) return usage_error(format.error());
  if (!args.format.empty() && !names_folder(args)) {
    return usage_error(
        {ErrorCode::invalid_argument, "goes with a folder as output; a file's name says its format", "--format"});
  }
  const Result<isp::DevelopOptions> options = complete_options(args, *format);
  if (!options) return usage_error(options.error());

  const Result<std::vector<std::string>> darks = dark_files(args);
  if (!darks) return usage_error(darks.error());

  Task task{args, *options, {}, std::move(*jobs), std::nullopt, std::nullopt};
  if (const Result<void> ready = prepare(*darks, task); !ready) {
    fmt::print(stderr, "{}\n", error_line(ready.error().where, ready.error()));
    return exit_failed;
  }
  return summarise(task, develop_all(task));
}

}  // namespace lowlux::cli
