#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "isp/base/executor.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/info/advise_bracket.h"
#include "isp/cli/info/advise_camera.h"
#include "isp/cli/info/advise_report.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/cli/verbs.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

/// Returns where `develop` takes the noise model of a frame from; nullopt: it finds none. The frame stays as it is.
std::optional<NoiseOrigin> noise_of(RawFrame& frame, Executor& executor) {
  const auto noise = frame.noise;
  auto warnings = frame.warnings;
  isp::DevelopOptions options;
  options.denoise.mode = isp::DenoiseChoice::Mode::automatic;
  const auto found = find_noise(options, {}, frame, executor);
  frame.noise = noise;
  frame.warnings = std::move(warnings);
  return found ? *found : std::nullopt;
}

int failed(const InfoArgs& args, const std::string& file, const Error& error) {
  if (error.code != ErrorCode::invalid_argument) return print_failure(file, error, object_if(args.json));
  const std::string place = error.where.empty() ? "" : " (" + error.where + ")";
  return print_usage_error("info", {error.code, error.message + place, {}}, object_if(args.json));
}

/// Advises on the frames of a merge.
int run_bracket(const InfoArgs& args, RawFrame& frame) {
  const Result<BracketCase> found = bracket_case(args.advise, frame);
  if (!found) return failed(args, args.inputs.front(), found.error());
  const FrameInfo& info = frame.raw.info;
  print_out(args.json ? bracket_json(*found, info) + "\n" : bracket_text(*found, info));
  return exit_done;
}

/// Runs `info --advise`: prints the advice and writes its page. @return the exit code
int run_advise(const InfoArgs& args) {
  const std::string subject = args.inputs.empty() ? args.advise.sensor : args.inputs.front();
  std::optional<RawFrame> frame;
  if (!args.inputs.empty()) {
    auto read = capture::read_raw(args.inputs.front());
    if (!read) return failed(args, subject, read.error());
    frame = *std::move(read);
  }
  if (frame && args.advise.sensor.empty()) return run_bracket(args, *frame);
  const auto asked = advice_case(args.advise, frame ? &*frame : nullptr);
  if (!asked) return failed(args, subject, asked.error());
  const auto advice = isp::advise_exposure(asked->request);
  if (!advice) return failed(args, subject, advice.error());
  if (!args.advise.report.empty()) {
    const auto overwrite = args.advise.force ? isp::Overwrite::yes : isp::Overwrite::no;
    const auto written = isp::write_text(args.advise.report, isp::html_of(advice_page(*asked, *advice)), overwrite);
    if (!written) return failed(args, args.advise.report, written.error());
  }
  if (args.json) {
    print_out(fmt::format("{}\n", advice_json(*asked, *advice)));
  } else {
    print_out(fmt::format("{}", advice_text(*asked, *advice)));
  }
  return exit_done;
}

}  // namespace

int run_info(const std::vector<std::string>& words) {
  const Parsed<InfoArgs> parsed = parse_info(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<InfoArgs>(parsed);
  if (args.advise.wanted) return run_advise(args);

  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64));
  int code = exit_done;
  std::string json;
  const auto report = [&](const std::string& file, const Error& error) {
    code = print_failure(file, error);
    if (args.json) json += (json.empty() ? "" : ",\n") + error_json(file, error);
  };
  for (const std::string& input : args.inputs) {
    const Result<std::vector<std::string>> files = raw_files_of(input);
    if (!files) report(input, files.error());
    for (const std::string& file : files.value_or(std::vector<std::string>())) {
      Result<RawFrame> frame = is_standard_stream(file) ? read_standard_input() : capture::read_raw(file);
      if (!frame) {
        report(file, frame.error());
        continue;
      }
      const std::optional<NoiseOrigin> noise = noise_of(*frame, executor);
      if (args.json) {
        json += (json.empty() ? "" : ",\n") + info_json(file, *frame, noise);
      } else {
        print_out(info_text(file, *frame, noise));
      }
    }
  }
  if (args.json) print_out(fmt::format("[{}]\n", json));
  return code;
}

}  // namespace lowlux::cli
