#include "isp/cli/calibrate/calibration.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calib/profile/profile_io.h"
#include "capture/file/dng_source.h"
#include "isp/base/camera_profile.h"
#include "isp/base/json_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/cli/shared/report.h"
#include "isp/output/atomic_file.h"

namespace lowlux::cli {
namespace {

/// Replaces invalid UTF-8: names of files hold any bytes, JSON holds UTF-8 only.
std::string readable(const std::string& name) {
  using Json = nlohmann::ordered_json;
  return Json::parse(json_text(Json(name))).get<std::string>();
}

/// Returns the report with the results, the method and the frames.
isp::Report whole_report(const CalibrateArgs& args, const Calibration& found) {
  isp::Report report = found.report;
  report.text = measurement_text(args.output);
  report.sections.push_back({"Frames", "", found.frames, {}});
  return report;
}

}  // namespace

Result<void> check_outputs(const CalibrateArgs& args) {
  if (auto place = check_output_path(args.output, args.force); !place) return place;
  if (args.report.empty()) return {};
  return check_output_path(args.report, args.force);
}

Result<CameraProfile> starting_profile(const CalibrateArgs& args) {
  return args.add_to.empty() ? CameraProfile{} : read_profile(args.add_to);
}

Result<RawFrame> read_calibration_frame(const std::string& file, const CalibrateArgs& args) {
  Result<RawFrame> frame = capture::read_raw(file);
  if (!frame) return tl::make_unexpected(with_file(std::move(frame.error()), file));
  FrameInfo& info = frame->raw.info;
  if (!info.iso) info.iso = args.iso;
  if (!info.exposure_s) info.exposure_s = args.exposure_s;
  if (!info.temperature_c) info.temperature_c = args.temperature_c;
  return frame;
}

Result<void> put_camera(const FrameInfo& info, CameraProfile& profile) {
  if (!may_be_same_camera({profile.make, profile.model}, {info.make, info.model})) {
    return fail(ErrorCode::invalid_argument,
                fmt::format(R"(the profile is of "{}", the added frames are of "{}")",
                            camera_name(profile.make, profile.model), camera_name(info.make, info.model)));
  }
  if (profile.make.empty()) profile.make = info.make;
  if (profile.model.empty()) profile.model = info.model;
  return {};
}

Result<void> put_mosaic(const std::string& mosaic, CameraProfile& profile) {
  if (!profile.mosaic.empty() && !mosaic.empty() && profile.mosaic != mosaic) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the profile is of a sensor that is {}, but the added frames are of one that is {}",
                            profile.mosaic, mosaic));
  }
  if (profile.mosaic.empty()) profile.mosaic = mosaic;
  return {};
}

void list_frame(const std::string& file, const std::string& use, const FrameInfo& info, isp::Table& frames) {
  frames.columns = {"file", "use", "ISO", "exposure time [s]", "temperature [C]"};
  const auto cell = [](const std::optional<double>& value) {
    return value ? fmt::format("{:g}", *value) : std::string("not stated");
  };
  frames.rows.push_back({readable(std::filesystem::path(file).filename().string()), use, cell(info.iso),
                         cell(info.exposure_s), cell(info.temperature_c)});
}

std::string measurement_text(const std::string& profile) {
  const calib::Measured today = measured_today({});
  return fmt::format("Measured on {} with {}.\nNext step: lowlux develop RAW -o OUT.png --profile {}", today.date,
                     today.source, readable(profile));
}

calib::Measured measured_today(std::vector<std::string> files) {
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  for (std::string& file : files) file = readable(std::filesystem::path(file).filename().string());
  return {"lowlux " + version_number(), fmt::format("{:%Y-%m-%d}", fmt::gmtime(now)), std::move(files)};
}

int calibration_failed(const CalibrateArgs& args, const Error& error) {
  const std::string what = error.where.empty() ? "calibrate" : error.where;
  return print_failure(what, error, object_if(args.json));
}

Result<void> write_calibration(const CalibrateArgs& args, const Calibration& found) {
  if (args.output.empty()) return {};
  const auto text = calib::profile_text(found.profile);
  if (!text) return tl::make_unexpected(with_file(text.error(), args.output));
  const auto overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  for (const PixelMap& map : found.maps) {
    if (auto free = check_output_path(map.path, args.force); !free) return free;
  }
  auto files = prepare_maps(found.maps, overwrite);
  if (!files) return tl::make_unexpected(files.error());
  std::vector<isp::TextFile> texts{{args.output, *text}};
  std::string report;
  if (!args.report.empty()) {
    report = isp::html_of(whole_report(args, found));
    texts.push_back({args.report, report});
  }
  auto pages = isp::prepare_texts(texts, overwrite);
  if (!pages) return tl::make_unexpected(pages.error());
  std::ranges::move(*pages, std::back_inserter(*files));
  return isp::AtomicFile::commit_all(*files);
}

int finish(const CalibrateArgs& args, const Calibration& found) {
  if (const auto written = write_calibration(args, found); !written) return calibration_failed(args, written.error());
  if (!args.quiet) {
    for (const std::string& warning : found.warnings) {
      print_err(fmt::format("{}\n", one_line("lowlux: warning: " + warning)));
    }
  }
  if (args.json) {
    const nlohmann::ordered_json json{{"output", args.output},
                                      {"warnings", found.warnings},
                                      {"profile", nlohmann::ordered_json::parse(*calib::profile_text(found.profile))}};
    print_out(fmt::format("{}\n", json_text(json, 2)));
  } else {
    print_out(fmt::format("{}", found.text));
  }
  return exit_done;
}

}  // namespace lowlux::cli
