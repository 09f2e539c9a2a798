#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/dark/dark_library.h"
#include "calib/frame_setting.h"
#include "calib/sheet/data_sheet.h"
#include "isp/base/result.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/calibrate/calibrate_noise.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/calibrate/sheet_report.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

/// Limits memory: 10 bytes for each pixel of each group while they are read, 8 afterwards.
constexpr std::size_t max_dark_groups = 24;

/// A dark frame's file and how it was taken.
struct DarkFile {
  std::string file;
  FrameInfo info;
};

/// Reads frames, which have to be of one camera and gain.
class Reader {
 public:
  Reader(const CalibrateSheetArgs& args, Calibration& found)
      : args_(args),
        found_(found),
        progress_(static_cast<int>(2 * args.darks.size() + 2 * args.common.frames.size()), !args.common.quiet) {}

  Result<RawDn> read(const std::string& file, const char* use) {
    auto frame = read_calibration_frame(file, args_.common);
    if (!frame) return tl::make_unexpected(frame.error());
    const FrameInfo& info = frame->raw.info;
    if (const auto same = put_camera(info, found_.profile); !same) {
      return fail(same.error().code, same.error().message, file);
    }
    if (!first_) first_ = info;
    if (info.iso != first_->iso) {
      return fail(ErrorCode::invalid_argument, "the frames are of several gain settings (ISO): make one sheet for each",
                  file);
    }
    if (use != nullptr) list_frame(file, use, info, found_.frames);
    progress_.advance(1, file);
    return std::move(frame->raw);
  }

 private:
  const CalibrateSheetArgs& args_;
  Calibration& found_;
  Progress progress_;
  std::optional<FrameInfo> first_;
};

bool belongs(const DarkFile& dark, const calib::FrameSetting& setting) {
  return setting.exposure_s == dark.info.exposure_s &&
         calib::same_temperature(setting.temperature_c, dark.info.temperature_c);
}

/// Averages darks by exposure time and temperature, the shortest first; single ones are left out with a warning.
/// @return the files of the first
Result<std::vector<std::string>> read_sheet_darks(const CalibrateSheetArgs& args, Reader& reader,
                                                  calib::SheetFrames& out, Calibration& found) {
  calib::DarkLibrary library(max_dark_groups);
  std::vector<DarkFile> darks;
  for (const std::string& file : args.darks) {
    const auto raw = reader.read(file, "dark");
    if (!raw) return tl::make_unexpected(raw.error());
    if (auto added = library.add(*raw); !added) return fail(added.error().code, added.error().message, file);
    darks.push_back({file, raw->info});
  }
  std::vector<calib::DarkGroup> groups = library.groups();
  std::ranges::stable_sort(groups, {}, [](const calib::DarkGroup& group) {
    return std::pair(group.setting.exposure_s, group.setting.temperature_c);
  });
  std::vector<std::string> first;
  for (const DarkFile& dark : darks) {
    if (belongs(dark, groups.front().setting)) first.push_back(dark.file);
  }
  if (groups.front().frames < 2) {
    return fail(ErrorCode::insufficient, "there is one dark of the shortest exposure time: take two or more, best 16",
                first.front());
  }
  for (calib::DarkGroup& group : groups) {
    if (group.frames > 1) {
      out.darks.push_back(std::move(group));
      continue;
    }
    found.warnings.push_back(fmt::format(
        "there is one dark of {:g} s{}: it is not used", group.setting.exposure_s.value_or(0),
        group.setting.temperature_c ? fmt::format(" at {:g} C", *group.setting.temperature_c) : std::string()));
  }
  return first;
}

Result<std::vector<FramePair>> read_pairs(const std::vector<std::string>& files, const char* use,
                                          const std::vector<FramePair>& darks, Reader& reader, Calibration& found) {
  FramePairs pairs(darks);
  for (const std::string& file : files) {
    auto raw = reader.read(file, use);
    if (!raw) return tl::make_unexpected(raw.error());
    if (auto added = pairs.add(*std::move(raw), file); !added) return tl::make_unexpected(added.error());
  }
  for (const std::string& file : pairs.alone()) {
    found.warnings.push_back(file + " is not used: there is no second flat of the same exposure time and level");
  }
  return pairs.pairs();
}

std::vector<calib::PairStatistics> statistics_of(const std::vector<FramePair>& pairs) {
  std::vector<calib::PairStatistics> out;
  out.reserve(pairs.size());
  for (const FramePair& pair : pairs) out.push_back(pair.statistics);
  return out;
}

double signal_dn(const FramePair& pair, const PerSite<double>& black_dn) {
  double most = 0;
  for (std::size_t s = 0; s < black_dn.size(); ++s)
    most = std::max(most, pair.statistics.site[s].mean_dn - black_dn[s]);
  return most;
}

/// Returns the files of the flats whose brightest site is nearest half of saturation.
std::vector<std::string> half_saturated(const std::vector<FramePair>& flats, const calib::PhotonTransfer& transfer) {
  constexpr double same_level = 0.005;  // relative: flicker of the lamp; levels of light that differ are further apart
  double most = 0;
  for (const FramePair& pair : flats) most = std::max(most, signal_dn(pair, transfer.black_dn));
  const double saturation_dn = transfer.saturation_capacity_e
                                   ? transfer.saturation_capacity_e->value * transfer.system_gain_dn_per_e.value
                                   : most;
  const auto distance = [&](const FramePair& pair) {
    return std::fabs(signal_dn(pair, transfer.black_dn) - saturation_dn / 2);
  };
  const FramePair& nearest = *std::ranges::min_element(flats, {}, distance);
  const double level_dn = signal_dn(nearest, transfer.black_dn);
  std::vector<std::string> out;
  for (const FramePair& pair : flats) {
    if (pair.statistics.setting.exposure_s != nearest.statistics.setting.exposure_s) continue;
    if (std::fabs(signal_dn(pair, transfer.black_dn) - level_dn) > same_level * level_dn) continue;
    out.insert(out.end(), pair.files.begin(), pair.files.end());
  }
  return out;
}

Result<calib::DarkGroup> average(const std::vector<std::string>& files, Reader& reader) {
  calib::DarkStack stack(calib::StackedFrames::flats);
  for (const std::string& file : files) {
    const auto raw = reader.read(file, nullptr);
    if (!raw) return tl::make_unexpected(raw.error());
    if (auto added = stack.add(*raw); !added) return fail(added.error().code, added.error().message, file);
  }
  return stack.group();
}

/// Reads the frames of a data sheet, one at a time. Darks are averaged by exposure time and temperature, flats paired;
/// the flats nearest half of saturation are read once more and averaged. Fills frames, warnings and camera of `found`.
/// Errors: those of reading; frames of several gain settings; more than max_dark_groups settings of darks; no two darks
/// of the shortest exposure; no pair of flats; those of fit_photon_transfer.
Result<calib::SheetFrames> read_sheet_frames(const CalibrateSheetArgs& args, Calibration& found) {
  Reader reader(args, found);
  calib::SheetFrames out{.steady_light = args.steady_light, .irradiance = args.irradiance};
  const auto first = read_sheet_darks(args, reader, out, found);
  if (!first) return tl::make_unexpected(first.error());
  const auto darks = read_pairs(*first, nullptr, {}, reader, found);
  if (!darks) return tl::make_unexpected(darks.error());
  const auto flats = read_pairs(args.common.frames, "flat", *darks, reader, found);
  if (!flats) return tl::make_unexpected(flats.error());
  if (flats->empty()) return fail(ErrorCode::insufficient, "no two flats form a pair; take two of each light");
  out.dark_pairs = statistics_of(*darks);
  out.flat_pairs = statistics_of(*flats);
  const auto transfer = calib::fit_photon_transfer(out.dark_pairs, out.flat_pairs);
  if (!transfer) return tl::make_unexpected(transfer.error());
  auto bright = average(half_saturated(*flats, *transfer), reader);
  if (!bright) return tl::make_unexpected(bright.error());
  out.bright = *std::move(bright);
  return out;
}

/// A data sheet and its files.
struct MadeSheet {
  Calibration found;
  std::string page;
  std::string json;
};

Result<MadeSheet> make_sheet(const CalibrateSheetArgs& args) {
  for (const std::string& file : {args.common.output, json_of_sheet(args.common.output)}) {
    if (const auto place = check_output_path(file, args.common.force); !place)
      return tl::make_unexpected(place.error());
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
