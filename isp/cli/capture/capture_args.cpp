#include "isp/cli/capture/capture_args.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "capture/camera/camera_request.h"
#include "isp/base/file_extension.h"
#include "isp/base/packed/raw_format.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/look_args.h"
#include "isp/cli/shared/option_values.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;
constexpr double longest_timeout_s = 86400;
constexpr double max_frames = 1e9;
constexpr double min_budget_ms = 0.01, max_budget_ms = 1e6;  // limits of the stage

/// Holds arguments that CaptureArgs stores in another form.
struct Words {
  bool raw = false;
  bool live = false;
  std::string as;
  std::optional<double> frames;
};

ArgumentError set_format(const std::string& text, capture::CameraRequest& request) {
  const auto formats = raw_formats();
  const auto found = std::ranges::find_if(formats, [&](const RawFormatNames& names) {
    return text == names.libcamera || (names.v4l2_fourcc != 0 && text == v4l2_text(names.v4l2_fourcc));
  });
  if (found == formats.end()) {
    return "is not a valid raw format: use a name of V4L2 (RG10, pRAA) or libcamera (SRGGB10, SRGGB10_CSI2P); --list "
           "prints those of the connected cameras";
  }
  request.format = found->format;
  return std::nullopt;
}

ArgumentError set_size(const std::string& text, capture::CameraRequest& request) {
  const auto cross = text.find('x');
  const auto whole = [](const std::string& digits) -> std::optional<int> {
    const auto number = number_of(digits);
    const bool fits = number && *number >= 1 && *number <= 65535 && *number == static_cast<int>(*number);
    return fits ? std::optional(static_cast<int>(*number)) : std::nullopt;
  };
  const auto width = whole(text.substr(0, cross));
  const auto height = cross == std::string::npos ? std::nullopt : whole(text.substr(cross + 1));
  if (!width || !height) return "is not a size such as 640x480";
  request.width = width;
  request.height = height;
  return std::nullopt;
}

std::function<ArgumentError(const std::string&)> store_positive(std::optional<double>& out, double most,
                                                                const char* unit) {
  return [&out, most, unit](const std::string& text) -> ArgumentError {
    const auto number = quantity_of(text, unit);
    if (!number || !(*number > 0 && *number <= most))
      return fmt::format("is not above 0 and at most {:g} {}", most, unit);
    out = number;
    return std::nullopt;
  };
}

void add_source(CLI::App& app, CaptureArgs& args) {
  app.add_flag("--list", args.list, "list the connected cameras and their raw formats");
  app.add_option("--v4l2", args.v4l2, "V4L2 camera: its device node")->type_name("/dev/videoN");
  app.add_option("--libcamera", args.libcamera, "libcamera camera: its id, its index in --list, or a part of its name")
      ->type_name("ID");
  capture::CameraRequest& request = args.request;
  add_text(app, "--format", "FORMAT",
           "raw format, by its name in V4L2 or libcamera (RG10, SRGGB10_CSI2P...; default: the one with most bits)",
           [&request](const std::string& text) { return set_format(text, request); });
  add_text(app, "--size", "WxH", "size of the frames (default: the largest)",
           [&request](const std::string& text) { return set_size(text, request); });
  add_text(app, "--fps", "HZ", "frames per second (default: the camera's setting)",
           store_positive(request.frame_rate_hz, 1e5, "Hz"));
  add_text(app, "--exposure-time", "S", "exposure time of a frame (default: the camera's setting)",
           store_positive(request.exposure_s, 1e5, "s"));
  add_text(app, "--gain", "X", "analogue gain as a factor (default: the camera's setting)",
           store_positive(request.analogue_gain, 1e6, "x"));
  app.add_option("--gain-code", args.gain_code,
                 "gain code of the driver, for V4L2 cameras that do not state their gain as a factor")
      ->type_name("CODE")
      ->excludes("--gain");
  add_text(app, "--flip", "h|v|hv",
           "flip the readout of the sensor horizontally, vertically or both (default: the camera's setting)",
           [&request](const std::string& text) -> ArgumentError {
             if (text != "h" && text != "v" && text != "hv") return "is none of h, v, hv";
             request.flip_horizontal = text.starts_with('h');
             request.flip_vertical = text.ends_with('v');
             return std::nullopt;
           });
  add_choice<capture::V4l2Memory>(
      app, "--memory", {{"mmap", capture::V4l2Memory::mmap}, {"dma-buf", capture::V4l2Memory::dma_buf}},
      [&args](capture::V4l2Memory memory) { args.memory = memory; },
      "how the buffers of a V4L2 camera are accessed (default: mmap)");
  app.add_option("--buffers", request.buffers, "number of frame buffers, 2 to 32 (default 4)")
      ->check(CLI::Range(2, 32));
}

void add_frames(CLI::App& app, CaptureArgs& args, Words& words) {
  const auto store_whole = [](auto store) {
    return [store](const std::string& text) -> ArgumentError {
      const auto number = number_of(text);
      if (!number || !(*number >= 0 && *number <= max_frames) ||
          *number != static_cast<double>(static_cast<std::uint64_t>(*number))) {
        return "is not a number of frames";
      }
      store(*number);
      return std::nullopt;
    };
  };
  add_text(app, "--frames", "N",
           "number of frames to take, 0: until interrupted (default: 1 to a file; 0 to a folder and with --live)",
           store_whole([&words](double number) { words.frames = number; }));
  add_text(app, "--skip", "N", "number of frames to discard first, while the exposure settles (default 0)",
           store_whole([&args](double number) { args.limits.skip = static_cast<std::uint64_t>(number); }));
  add_text(app, "--timeout", "S", "longest time to wait for a frame (default 5)",
           [&args](const std::string& text) -> ArgumentError {
             const auto number = quantity_of(text, "s");
             if (!number || !(*number >= 0.001 && *number <= longest_timeout_s)) {
               return fmt::format("is not within 0.001 to {:g} s", longest_timeout_s);
             }
             args.limits.timeout = std::chrono::milliseconds(static_cast<std::int64_t>(*number * 1000));
             return std::nullopt;
           });
}

void add_output(CLI::App& app, CaptureArgs& args, Words& words) {
  app.add_option("-o,--output", args.develop.output,
                 "image (.png .jpg .tif .exr .pfm) or raw file (.dng) to write, numbered -NNNN if there are several "
                 "frames; or a folder (created if it ends with /)")
      ->type_name("OUT");
  app.add_option("--as", words.as, "type of the files in a folder (default: png)")
      ->check(CLI::IsMember({"png", "jpg", "tif", "exr", "pfm", "dng"}));
  app.add_flag("--raw", words.raw, "write raw files, like --as dng");
  app.add_flag("--live", words.live, "write video to standard output: YUV4MPEG2, which ffplay and ffmpeg read");
  app.add_flag("--temporal", args.temporal, "with --live: use previous frames for noise reduction");
  add_text(app, "--budget-ms", "MS", "with --live: time limit for each frame; noise reduction is lowered until it fits",
           [&args](const std::string& text) -> ArgumentError {
             args.budget_ms = quantity_of(text, "ms");
             if (args.budget_ms && *args.budget_ms >= min_budget_ms && *args.budget_ms <= max_budget_ms) {
               return std::nullopt;
             }
             return "is not a number of milliseconds from 0.01 to 1e6";
           });
  app.add_flag("--force", args.develop.force, "overwrite files that exist");
  app.add_flag("--json", args.develop.json, "print a report as JSON on stdout (with --live on stderr)");
  app.add_flag("--quiet", args.develop.quiet, "print no warnings, no progress and no summary");
}

// The first list applies to images alone, the second to images and videos; neither applies to raw files.
constexpr std::array of_pictures{"--bits",         "--quality",         "--space",        "--half",
                                 "--repair",       "--line-noise",      "--effects",      "--tolerance",
                                 "--dimming",      "--noise-limit",     "--coefficients", "--display-luminance",
                                 "--gain-setting", "--chroma-bias",     "--light",        "--adaptation-degree",
                                 "--noise",        "--saturation-level"};
constexpr std::array of_pictures_and_films{"--exposure",      "--wb",     "--tone", "--look", "--scene-luminance",
                                           "--field-of-view", "--denoise"};

/// Returns the first of these options that was given.
std::optional<std::string> given_of(const CLI::App& app, std::span<const char* const> options) {
  const auto found = std::ranges::find_if(options, [&](const char* option) { return app.count(option) > 0; });
  return found == options.end() ? std::nullopt : std::optional<std::string>(*found);
}

ArgumentError raw_output_error(const CLI::App& app, const CaptureArgs& args) {
  auto given = given_of(app, of_pictures);
  if (!given) given = given_of(app, of_pictures_and_films);
  if (!given && !args.auto_exposure.wanted) given = given_of(app, std::array{"--profile"});
  if (given) return *given + " does not apply to raw files: use it with `develop`";
  const isp::BlackChoice black = args.develop.options.black.choice;
  if (!args.develop.black_profile.empty() ||
      (black != isp::BlackChoice::automatic && black != isp::BlackChoice::given)) {
    return "--black of a raw file must be one or four numbers in DN";
  }
  return std::nullopt;
}

ArgumentError live_output_error(const CLI::App& app, const CaptureArgs& args) {
  if (const auto given = given_of(app, of_pictures)) return *given + " applies to image files, not to --live";
  const isp::DevelopOptions& options = args.develop.options;
  using WhiteMode = isp::WhiteBalanceChoice::Mode;
  if (options.white_balance.mode != WhiteMode::as_shot && options.white_balance.mode != WhiteMode::automatic) {
    return "--wb with --live must be as-shot or auto";
  }
  if (options.exposure_offset_ev != 0) return "--exposure with --live must be auto or a number of EV";
  if (options.look.look == isp::Look::model) return "--look with --live must be camera or eye";
  if (options.denoise.mode == isp::DenoiseChoice::Mode::level && options.denoise.level == denoise::Level::best) {
    return "--denoise best takes seconds for each frame: with --live use up to high";
  }
  const isp::BlackChoice black = options.black.choice;
  if (!args.develop.black_profile.empty() ||
      (black != isp::BlackChoice::automatic && black != isp::BlackChoice::given)) {
    return "--black with --live must be one or four numbers in DN; --profile names a profile";
  }
  return std::nullopt;
}

ArgumentError camera_error(const CaptureArgs& args) {
  if (args.v4l2.empty() == args.libcamera.empty()) {
    return "name one camera: --v4l2 /dev/videoN or --libcamera ID; --list prints the connected cameras";
  }
  if (args.v4l2.empty() && args.gain_code) return "--gain-code is an option of V4L2 cameras";
  if (const auto checked = capture::check_camera_request(args.request); !checked) return checked.error().message;
  return std::nullopt;
}

/// Sets the destination and kind of the frames.
ArgumentError set_kind(const Words& words, CaptureArgs& args) {
  const std::string& output = args.develop.output;
  if (words.live) {
    if (!output.empty() || words.raw || !words.as.empty())
      return "--live writes video to standard output and no files: leave --output, --raw and --as out";
    args.kind = CaptureKind::live;
    return std::nullopt;
  }
  if (args.temporal) return "--temporal requires --live";
  if (args.budget_ms) return "--budget-ms requires --live; for files use `develop`";
  if (output.empty()) return "name an output: -o OUT, or --live";
  std::error_code ignored;
  args.folder = output.ends_with('/') || fs::is_directory(output, ignored);
  if (words.raw && !words.as.empty() && words.as != "dng")
    return "--raw and --as " + words.as + " contradict each other";
  if (args.folder) {
    args.extension = words.raw ? "dng" : words.as.empty() ? "png" : words.as;
    args.kind = args.extension == "dng" ? CaptureKind::raw : CaptureKind::pictures;
    return std::nullopt;
  }
  if (!words.as.empty()) return "--as requires a folder as output; the name of a file states its format";
  args.kind = has_extension(output, ".dng") ? CaptureKind::raw : CaptureKind::pictures;
  if (words.raw && args.kind != CaptureKind::raw) return "--raw writes .dng files: name one instead of " + output;
  if (args.kind == CaptureKind::pictures) {
    if (const auto format = isp::format_of(output); !format) return format.error().message + " or .dng";
  }
  return std::nullopt;
}

ArgumentError complete(const CLI::App& app, const Words& words, CaptureArgs& args) {
  if (args.list) return std::nullopt;
  if (auto wrong = camera_error(args)) return wrong;
  if (auto wrong = auto_exposure_error(app, args.auto_exposure)) return wrong;
  if (auto wrong = set_kind(words, args)) return wrong;
  DevelopArgs& develop = args.develop;
  if (auto wrong = profile_option_error(develop)) return wrong;
  const bool as_develop = args.kind == CaptureKind::pictures;
  const Planner planner = as_develop ? Planner::of_everything : Planner::of_look;
  if (auto wrong = complete_look(develop.look, planner, develop.options.look)) return wrong;
  if (as_develop) {
    if (auto wrong = complete_effects(develop.look, develop.effects)) return wrong;
  }
  const bool endless = args.folder || args.kind == CaptureKind::live;
  args.limits.frames = static_cast<std::uint64_t>(words.frames.value_or(endless ? 0 : 1));
  if (args.kind == CaptureKind::raw) return raw_output_error(app, args);
  return args.kind == CaptureKind::live ? live_output_error(app, args) : std::nullopt;
}

}  // namespace

Parsed<CaptureArgs> parse_capture(const std::vector<std::string>& words) {
  CLI::App app("Takes raw frames from a camera and writes images, raw files, or video to standard output.",
               "lowlux capture");
  CaptureArgs args;
  Words said;
  add_source(app, args);
  add_auto_exposure(app, args.auto_exposure);
  add_frames(app, args, said);
  add_output(app, args, said);
  add_samples(app, args.develop);
  add_rendering(app, args.develop);
  add_look(app, args.develop.look);
  add_camera(app, args.develop);
  add_denoise(app, args.develop);
  if (const auto code = parse_arguments(app, words, &args.develop.defaults)) return *code;
  if (const auto wrong = complete(app, said, args)) return refuse(app, *wrong);
  return args;
}

std::string frame_file(const CaptureArgs& args, std::uint64_t index) {
  if (args.folder)
    return (fs::path(args.develop.output) / fmt::format("frame-{:04}.{}", index, args.extension)).string();
  if (args.limits.frames == 1) return args.develop.output;
  const fs::path output(args.develop.output);
  return (output.parent_path() / fmt::format("{}-{:04}{}", output.stem().string(), index, output.extension().string()))
      .string();
}

}  // namespace lowlux::cli
