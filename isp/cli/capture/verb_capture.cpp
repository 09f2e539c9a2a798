#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "capture/camera/capture_loop.h"
#include "capture/v4l2/v4l2_source.h"
#include "isp/base/executor.h"
#include "isp/cli/capture/auto_exposure.h"
#include "isp/cli/capture/capture_args.h"
#include "isp/cli/capture/capture_list.h"
#include "isp/cli/capture/capture_report.h"
#include "isp/cli/capture/capture_sink.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // a signal handler sets it

void ask_to_stop(int /*signal*/) { stop_asked = true; }

/// Makes the first SIGINT or SIGTERM request an end; a second one ends the process as by default. Signals the caller
/// ignores stay ignored.
void listen_to_signals() {
  struct sigaction ask {};
  ask.sa_handler = ask_to_stop;
  ask.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int number : {SIGINT, SIGTERM}) {
    struct sigaction before {};
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(number, &ask, nullptr);
  }
}

Result<std::unique_ptr<capture::Camera>> open_camera(const CaptureArgs& args) {
  if (!args.v4l2.empty()) {
    return capture::open_v4l2(args.v4l2, {.request = args.request,
                                          .memory = args.memory,
                                          .gain_code = args.gain_code,
                                          .gain_codes = args.auto_exposure.gain_codes});
  }
  return load_libcamera().and_then(
      [&](const capture::LibcameraModule& module) { return module.open(args.libcamera, args.request); });
}

/// Returns the number in a name that frame_file() makes; 0 for other names.
std::uint64_t index_in(std::string_view name, std::string_view before, std::string_view after) {
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after)) return 0;
  name = name.substr(before.size(), name.size() - before.size() - after.size());
  std::uint64_t index = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
  return error == std::errc() && end == name.data() + name.size() ? index : 0;
}

/// Checks before the camera is opened that no output file exists; the writers check again.
Result<void> check_files(const CaptureArgs& args) {
  const DevelopArgs& develop = args.develop;
  if (args.folder) {
    std::error_code error;
    fs::create_directories(develop.output, error);
    if (error) return fail(ErrorCode::unwritable, "the folder cannot be created: " + error.message(), develop.output);
  }
  const std::string first = frame_file(args, 1);
  if (auto place = check_output_path(first, develop.force); !place || args.limits.frames == 1 || develop.force)
    return place;
  const std::string name = fs::path(first).filename().string();
  const std::size_t at = name.rfind("0001");
  const fs::path folder = fs::path(first).parent_path();
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string file = entry->path().string();
    const std::uint64_t index = index_in(entry->path().filename().string(), name.substr(0, at), name.substr(at + 4));
    if (index == 0 || (args.limits.frames > 0 && index > args.limits.frames)) continue;
    return fail(ErrorCode::exists, fmt::format("{} exists: use --force to overwrite it", file), file);
  }
  return {};
}

class Capture {
 public:
  explicit Capture(const CaptureArgs& args)
      : args_(args), executor_(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8)) {}

  Result<void> run() {
    if (args_.kind != CaptureKind::live) {
      if (auto free = check_files(args_); !free) return free;
    }
    auto camera = open_camera(args_);
    if (!camera) return tl::make_unexpected(camera.error());
    state_.stream = {(*camera)->format(), (*camera)->name()};
    auto sink = make_sink();
    if (!sink) return tl::make_unexpected(sink.error());
    if (args_.auto_exposure.wanted) {
      auto taken = AutoExposure::make(args_, **camera);
      if (!taken) return tl::make_unexpected(taken.error());
      exposure_ = *std::move(taken);
    }
    take_warnings(**camera);
    if (args_.kind == CaptureKind::live) print_warnings();  // the end would be too late for a video
    CaptureProgress progress(!args_.develop.quiet);
    const auto work = [&](const capture::CameraFrame& frame) { return (*sink)->take(frame, state_.work); };
    const auto watch = [&](const capture::LoopCount&) { progress.show(state_); };
    const auto check = [&](capture::CameraFrame& frame) { return meter(frame); };
    auto done = capture::capture_frames(**camera, args_.limits, stop_asked, work, watch, state_.count, check);
    take_warnings(**camera);
    exposure_.reset();  // it refers to the camera
    return done;
  }

  int finish(const Result<void>& done) {
    const Error* error = done ? nullptr : &done.error();
    if (error != nullptr) {
      const std::string taken = state_.count.taken > 0 ? fmt::format(" (after {} frames)", state_.count.taken) : "";
      const std::string camera = args_.v4l2.empty() ? "libcamera " + args_.libcamera : args_.v4l2;
      const bool of_camera = error->where.empty() || error->where == args_.libcamera;
      const std::string& place = of_camera ? camera : error->where;
      print_err(fmt::format("{}\n", error_line(place, {error->code, error->message + taken, {}})));
    } else if (!args_.develop.quiet) {
      print_warnings();
      print_err(fmt::format("lowlux: {}\n", progress_text(state_)));
    }
    if (args_.develop.json) {
      print_text(args_.kind == CaptureKind::live ? stderr : stdout, capture_json(state_, error) + "\n");
    }
    return error == nullptr ? exit_done : exit_failed;
  }

 private:
  /// Sets the exposure by a frame, if it is automatic. Returns whether the frame is used: files wait for the exposure.
  Result<bool> meter(capture::CameraFrame& frame) {
    if (!exposure_) return true;
    const bool was_ready = exposure_->is_ready();
    const auto taken = exposure_->take(frame);
    state_.exposure = exposure_->state();
    if (!taken) return tl::make_unexpected(taken.error());
    if (!was_ready && exposure_->is_ready() && !exposure_->found()) {
      warn_once("automatic exposure has not settled in 500 frames: is the light steady?", state_.work);
    }
    return args_.kind == CaptureKind::live || exposure_->is_ready();
  }

  Result<std::unique_ptr<CaptureSink>> make_sink() {
    switch (args_.kind) {
      case CaptureKind::raw:
        return make_raw_sink(args_, state_.stream);
      case CaptureKind::live:
        return make_live_sink(args_, state_.stream, STDOUT_FILENO, stop_asked);
      case CaptureKind::pictures:
        break;
    }
    return make_picture_sink(args_, state_.stream, executor_);
  }

  void take_warnings(const capture::Camera& camera) {
    for (const std::string& warning : camera.warnings()) warn_once(warning, state_.work);
  }

  void print_warnings() {
    if (args_.develop.quiet) return;
    for (; printed_ < state_.work.warnings.size(); ++printed_) {
      print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", state_.stream.camera,
                                                         state_.work.warnings[printed_]))));
    }
  }

  const CaptureArgs& args_;
  PoolExecutor executor_;
  std::unique_ptr<AutoExposure> exposure_;
  CaptureState state_;
  std::size_t printed_ = 0;  // number of warnings
};

}  // namespace

int run_capture(const std::vector<std::string>& words) {
  const Parsed<CaptureArgs> parsed = parse_capture(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CaptureArgs>(parsed);
  if (args.list) return list_cameras(args.develop.json);
  const bool is_video = args.kind == CaptureKind::live;
  const FailureJson json = is_video && args.develop.json ? FailureJson::object_on_stderr : object_if(args.develop.json);
  if (args.kind == CaptureKind::pictures) {
    const auto format = isp::format_of(frame_file(args, 1));
    if (!format) return print_usage_error("capture", format.error(), json);
    if (const auto fits = complete_options(args.develop, *format); !fits)
      return print_usage_error("capture", fits.error(), json, args.develop.defaults);
  }
  if (is_video && ::isatty(STDOUT_FILENO) == 1) {
    return print_usage_error(
        "capture",
        {ErrorCode::invalid_argument, "writes video to a terminal: pipe it to a player (| ffplay -)", "--live"}, json);
  }
  listen_to_signals();
  Capture capture(args);
  return capture.finish(capture.run());
}

}  // namespace lowlux::cli
