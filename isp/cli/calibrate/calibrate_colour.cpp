#include "isp/cli/calibrate/calibrate_colour.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/profile/profile_io.h"
#include "isp/base/executor.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/calibrate/calibrate_colour_report.h"
#include "isp/cli/calibrate/calibrate_colour_work.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/cli/shared/report.h"
#include "isp/output/picture/image_writer.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

Result<void> check_places(const CalibrateColourArgs& args) {
  for (const std::string& file : {args.output, args.report, args.overlay}) {
    if (file.empty()) continue;
    if (auto place = check_output_path(file, args.force); !place) return place;
  }
  return {};
}

Result<void> write_files(const CalibrateColourArgs& args, const ColourOutcome& outcome, Executor& executor) {
  if (args.output.empty()) return {};
  const auto profile = colour_profile(args, outcome);
  if (!profile) return tl::make_unexpected(profile.error());
  const auto overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  std::vector<isp::AtomicFile> files;
  if (!args.overlay.empty() && outcome.chart) {
    isp::WriteOptions write;
    write.overwrite = overwrite;
    write.software = "lowlux " + version_number();
    auto file =
        isp::prepare_picture(colour_overlay(*outcome.chart), OutputSpace::srgb, {}, args.overlay, write, executor);
    if (!file) return tl::make_unexpected(file.error());
    files.push_back(*std::move(file));
  }
  const auto text = calib::profile_text(*profile);
  if (!text) return fail(text.error().code, text.error().message, args.output);
  std::vector<isp::TextFile> texts{{args.output, *text}};
  std::string report;
  if (!args.report.empty()) {
    report = isp::html_of(colour_report(outcome, args.output));
    texts.push_back({args.report, report});
  }
  auto pages = isp::prepare_texts(texts, overwrite);
  if (!pages) return tl::make_unexpected(pages.error());
  std::ranges::move(*pages, std::back_inserter(files));
  return isp::AtomicFile::commit_all(files);
}

}  // namespace

Result<CameraProfile> colour_profile(const CalibrateColourArgs& args, const ColourOutcome& outcome) {
  CameraProfile profile;
  if (!args.add_to.empty()) {
    auto before = read_profile(args.add_to);
    if (!before) return before;
    profile = *std::move(before);
  }
  FrameInfo camera;
  camera.make = outcome.make;
  camera.model = outcome.model;
  if (const auto same = put_camera(camera, profile); !same) {
    return fail(same.error().code, same.error().message, args.add_to);
  }
  std::erase_if(profile.colours,
                [&](const ColourProfile& colour) { return colour.illuminant == outcome.colour.illuminant; });
  profile.colours.push_back(outcome.colour);
  std::stable_sort(profile.colours.begin(), profile.colours.end(),
                   [](const auto& a, const auto& b) { return a.calibration.cct_k < b.calibration.cct_k; });
  return profile;
}

Result<ColourOutcome> calibrate_colour(const CalibrateColourArgs& args, Executor& executor) {
  if (auto free = check_places(args); !free) return tl::make_unexpected(free.error());
  auto outcome = args.chart.empty() ? colour_from_spectra(args) : colour_from_chart(args, executor);
  if (!outcome) return outcome;
  if (auto written = write_files(args, *outcome, executor); !written) return tl::make_unexpected(written.error());
  return outcome;
}

int run_calibrate_colour(const std::vector<std::string>& words) {
  const Parsed<CalibrateColourArgs> parsed = parse_calibrate_colour(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateColourArgs>(parsed);
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const auto outcome = calibrate_colour(args, executor);
  if (!outcome) {
    const std::string& input = args.chart.empty() ? args.camera : args.chart;
    const std::string& where = outcome.error().where;
    print_err(fmt::format("{}\n", error_line(where.empty() ? input : where, outcome.error())));
    if (args.json) print_out(fmt::format("{}\n", error_json(input, outcome.error())));
    return exit_failed;
  }
  for (const std::string& warning : outcome->warnings) {
    print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", outcome->input, warning))));
  }
  if (args.json) {
    print_out(fmt::format("{}\n", colour_json(*outcome, args.output)));
  } else {
    print_out(fmt::format("{}", colour_text(*outcome)));
  }
  return exit_done;
}

}  // namespace lowlux::cli
