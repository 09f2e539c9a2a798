#include <array>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/calibrate/sheet_frames.h"
#include "isp/cli/calibrate/sheet_report.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/report.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

/// A data sheet and its files.
struct MadeSheet {
  Calibration found;
  std::string page;
  std::string json;
};

Result<MadeSheet> make_sheet(const CalibrateSheetArgs& args) {
  for (const std::string& file : {args.common.output, json_of_sheet(args.common.output)}) {
    if (const auto place = check_place(file, args.common.force); !place) return tl::make_unexpected(place.error());
  }
  MadeSheet out;
  const auto frames = read_sheet_frames(args, out.found);
  if (!frames) return tl::make_unexpected(frames.error());
  const auto sheet = calib::make_data_sheet(*frames);
  if (!sheet) return tl::make_unexpected(sheet.error());
  show_data_sheet(*sheet, *frames, out.found);
  const calib::Measured today = measured_today({});
  out.found.report.title = camera_name(out.found.profile.make, out.found.profile.model) + ": data sheet";
  out.found.report.text = fmt::format("Measured on {} with {}.", today.date, today.source);
  out.page = isp::html_of(out.found.report);
  out.json = sheet_json(*sheet, *frames, out.found);
  return out;
}

Result<void> write_sheet(const CalibrateArgs& args, const MadeSheet& made) {
  const std::array files{isp::TextFile{json_of_sheet(args.output), made.json}, isp::TextFile{args.output, made.page}};
  return isp::write_texts(files, args.force ? isp::Overwrite::yes : isp::Overwrite::no);
}

}  // namespace

std::string json_of_sheet(const std::string& page) { return page.substr(0, page.rfind('.')) + ".json"; }

int run_calibrate_sheet(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_sheet(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateSheetArgs>(parsed);
  const auto made = make_sheet(args);
  if (!made) return calibration_failed(args.common, made.error());
  if (const auto written = write_sheet(args.common, *made); !written) {
    return calibration_failed(args.common, written.error());
  }
  if (!args.common.quiet) {
    for (const std::string& warning : made->found.warnings) {
      print_err(fmt::format("{}\n", one_line("lowlux: warning: " + warning)));
    }
  }
  print_out(args.common.json ? made->json : made->found.text);
  return exit_done;
}

}  // namespace lowlux::cli
