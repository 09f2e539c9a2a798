#include "isp/bench/methods/method.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "capture/file/picture_source.h"
#include "isp/base/text.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/private_folder.h"

namespace lowlux::isp {
namespace {

// All write sRGB codes with the camera's white balance and matrix, without brightening. dcraw's and LibRaw's wavelets
// have a threshold of 100, dcraw's own example. RawTherapee's tone curves are off, its denoiser chooses chroma itself.
constexpr std::array all_ready{
    ReadyMethod{"dcraw", "dcraw -c -w -W -6 -g 2.4 12.92 -o 1 -q 3 -H 0 -n 100 {in} > {out.ppm}", "command -v dcraw",
                "dcraw"},
    ReadyMethod{"libraw", "dcraw_emu -w -W -6 -g 2.4 12.92 -o 1 -q 3 -H 0 -n 100 -Z {out.ppm} {in}",
                "command -v dcraw_emu", "LibRaw's dcraw_emu (Debian: libraw-bin)"},
    ReadyMethod{"rawtherapee",
                "printf '%s\\n' '[Exposure]' Auto=false Compensation=0 Contrast=0 Saturation=0 Black=0 "
                "HighlightCompr=0 ShadowCompr=0 HistogramMatching=false 'Curve=0;' 'Curve2=0;' '[HLRecovery]' "
                "Enabled=false '[White Balance]' Enabled=true Setting=Camera '[Sharpening]' Enabled=false "
                "'[PostDemosaicSharpening]' Enabled=false '[Directional Pyramid Denoising]' Enabled=true Method=Lab "
                "Luma=40 Ldetail=50 CMethod=AUT '[RAW Bayer]' Method=amaze Border=0 '[LensProfile]' LcMode=none "
                "'[Color Management]' ToneCurve=false "
                "ApplyLookTable=false ApplyBaselineExposureOffset=false WorkingProfile=sRGB OutputProfile=RTv4_sRGB "
                "> \"$TMPDIR/neutral.pp3\" && rawtherapee-cli -q -Y -t -b16 -o {out.tif} -p \"$TMPDIR/neutral.pp3\" "
                "-c {in}",
                "command -v rawtherapee-cli", "rawtherapee-cli (Debian: rawtherapee)"},
    ReadyMethod{"darktable",
                "darktable-cli {in} {out.tif} --core --configdir \"$TMPDIR/darktable\" --library :memory: "
                "--conf plugins/darkroom/workflow=none --conf plugins/imageio/format/tiff/bpp=16",
                "command -v darktable-cli", "darktable-cli (Debian: darktable)"},
    ReadyMethod{
        "opencv",
        "dcraw -c -w -W -g 2.4 12.92 -o 1 -q 3 -H 0 {in} > \"$TMPDIR/noisy.ppm\" && /usr/bin/python3 -c 'import "
        "cv2, sys; cv2.imwrite(sys.argv[2], cv2.fastNlMeansDenoisingColored(cv2.imread(sys.argv[1]), None, 10, "
        "10, 7, 21))' \"$TMPDIR/noisy.ppm\" {out.png}",
        "command -v dcraw && /usr/bin/python3 -c 'import cv2'",
        "dcraw, and cv2 of /usr/bin/python3 (Debian: python3-opencv)"},
};

constexpr std::size_t longest_name = 40;
constexpr std::int64_t pixel_margin = 16;  // an output may have so many times the pixels of the frame, to be reported
constexpr std::array<std::string_view, 8> extensions{"dng", "png", "tif", "tiff", "jpg", "ppm", "pfm", "exr"};

tl::unexpected<Error> wrong_command(const std::string& why) {
  return fail(ErrorCode::invalid_argument,
              why +
                  ": a command is NAME='PROGRAM {in} {out}', where {out} is a DNG and {out.png}, {out.tif} or "
                  "{out.ppm} an image");
}

/// Replaces all occurrences of a text; returns their number.
int replace_all(std::string& text, std::string_view from, const std::string& to) {
  int count = 0;
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()), ++count) {
    text.replace(at, from.size(), to);
  }
  return count;
}

Result<ScoredMethod> ready_method(const std::string& name) {
  std::vector<std::string_view> names;
  std::string all;
  for (const ReadyMethod& ready : ready_methods()) {
    names.push_back(ready.name);
    all += (all.empty() ? "" : ", ") + std::string(ready.name);
    if (ready.name != name) continue;
    const auto folder = PrivateFolder::make();
    if (!folder) return tl::make_unexpected(folder.error());
    if (run_contained(std::string(ready.check), folder->path(), {})) {
      return ScoredMethod{.name = name, .command = std::string(ready.command)};
    }
    return fail(ErrorCode::not_found, "it is not installed: it needs " + std::string(ready.needs), "method " + name);
  }
  const auto near = near_matches(name, names);
  return wrong_command(fmt::format("unknown method '{}'{}; known methods are {}", name,
                                   near.empty() ? "" : fmt::format(", did you mean {}?", near.front()), all));
}

/// Returns an Error unless the path is a regular file with content; links and pipes are not followed.
Result<void> check_output(const std::filesystem::path& output) {
  std::error_code failed;
  const auto status = std::filesystem::symlink_status(output, failed);
  if (!std::filesystem::exists(status)) {
    return fail(ErrorCode::not_found,
                fmt::format("it wrote no {}, and ended without an error", output.filename().string()));
  }
  if (!std::filesystem::is_regular_file(status)) {
    return fail(ErrorCode::unreadable, output.filename().string() + " is not a regular file");
  }
  if (std::filesystem::file_size(output, failed) == 0) {
    return fail(ErrorCode::malformed, output.filename().string() + " is empty");
  }
  return {};
}

Result<MethodImage> read_output(const std::filesystem::path& output, const RawFrame& noisy, const CommandLimits& limits,
                                Executor& executor) {
  if (const auto good = check_output(output); !good) return tl::make_unexpected(good.error());
  const std::int64_t max_pixels = pixel_margin * static_cast<std::int64_t>(noisy.raw.samples());
  const auto named = [&](Error error) {
    error.message = output.filename().string() + ": " + error.message;
    error.where.clear();
    return tl::make_unexpected(std::move(error));
  };
  if (output.extension() == ".dng") {
    auto raw = capture::read_raw(output, {.max_file_bytes = limits.max_file_bytes, .max_pixels = max_pixels});
    if (!raw) return named(std::move(raw.error()));
    return MethodImage(*std::move(raw));
  }
  auto picture = capture::read_picture(output.string(), executor, {.max_pixels = max_pixels});
  if (!picture) return named(std::move(picture.error()));
  return MethodImage(std::move(picture->xyz));
}

Result<MethodRun> run_command(const ScoredMethod& method, const RawFrame& noisy, const CommandLimits& limits,
                              Executor& executor) {
  const auto folder = PrivateFolder::make();
  if (!folder) return tl::make_unexpected(folder.error());
  const auto command = expand_command(method.command, folder->path());
  if (!command) return tl::make_unexpected(command.error());
  if (auto written = write_dng(noisy, (folder->path() / noisy_file).string()); !written) {
    return tl::make_unexpected(written.error());
  }
  const auto use = run_contained(command->line, folder->path(), limits);
  if (!use) return tl::make_unexpected(use.error());
  auto image = read_output(command->output, noisy, limits, executor);
  if (!image) return tl::make_unexpected(image.error());
  return MethodRun{*std::move(image), *use};
}

double process_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Result<MethodRun> run_function(const ScoredMethod& method, const RawFrame& noisy) {
  const double cpu_s = process_cpu_s();
  const auto begin = std::chrono::steady_clock::now();
  auto image = method.call(noisy);
  if (!image) return tl::make_unexpected(image.error());
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  return MethodRun{*std::move(image),
                   {.wall_s = wall.count(),
                    .cpu_s = process_cpu_s() - cpu_s,
                    .peak_bytes = std::numeric_limits<double>::quiet_NaN()}};
}

}  // namespace

std::span<const ReadyMethod> ready_methods() { return all_ready; }

bool is_method_name(std::string_view name) {
  const auto alphanumeric = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  return !name.empty() && name.size() <= longest_name && alphanumeric(name.front()) &&
         std::ranges::all_of(name, [&](char c) { return alphanumeric(c) || c == '.' || c == '_' || c == '-'; });
}

Result<ScoredMethod> method_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return ready_method(text);
  ScoredMethod method{.name = text.substr(0, equals), .command = text.substr(equals + 1)};
  if (!is_method_name(method.name)) {
    return wrong_command(
        fmt::format("'{}' is not a name of 1 to {} letters, digits and ._-", method.name, longest_name));
  }
  if (const auto expanded = expand_command(method.command, "/"); !expanded) {
    return tl::make_unexpected(expanded.error());
  }
  return method;
}

Result<ExpandedCommand> expand_command(const std::string& command, const std::filesystem::path& folder) {
  ExpandedCommand out{command, {}};
  if (replace_all(out.line, "{in}", shell_word((folder / noisy_file).string())) == 0) {
    return wrong_command("the command does not contain {in}, the raw file");
  }
  int outputs = 0;
  const auto put = [&](std::string_view placeholder, std::string_view extension) {
    const std::filesystem::path file = folder / fmt::format("clean.{}", extension);
    if (replace_all(out.line, placeholder, shell_word(file.string())) == 0) return;
    out.output = file;
    ++outputs;
  };
  put("{out}", "dng");
  for (const std::string_view extension : extensions) {
    if (extension != "dng" || outputs == 0) put(fmt::format("{{out.{}}}", extension), extension);
  }
  if (outputs == 0) return wrong_command("the command does not contain {out}, the output");
  if (outputs > 1) return wrong_command("the command contains outputs of two kinds");
  return out;
}

Result<MethodRun> run_method(const ScoredMethod& method, const RawFrame& noisy, const CommandLimits& limits,
                             Executor& executor) {
  return method.command.empty() ? run_function(method, noisy) : run_command(method, noisy, limits, executor);
}

}  // namespace lowlux::isp
