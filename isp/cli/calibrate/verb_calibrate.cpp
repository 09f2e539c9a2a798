#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/noise/raspberry_tuning.h"
#include "calib/profile/quoted_profile.h"
#include "capture/file/file_bytes.h"
#include "isp/base/file_extension.h"
#include "isp/cli/calibrate/calibrate_colour.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/help/help_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

struct Kind {
  std::string_view name;
  std::string_view summary;
  int (*run)(const std::vector<std::string>& words);
};

constexpr std::array kinds{
    Kind{"black", "pedestal, dark current and hot pixels from dark frames, or from masked pixels", run_calibrate_black},
    Kind{"colour", "colour matrices from a photographed chart or spectral sensitivities", run_calibrate_colour},
    Kind{"noise", "gain, read noise and full well from flats, or noise from one ordinary image", run_calibrate_noise},
    Kind{"quoted", "a profile from the published figures of a sensor", run_calibrate_quoted},
    Kind{"sheet", "a data sheet by EMVA 1288, from flats and darks", run_calibrate_sheet},
};

void print_help() {
  print_out(
      "Measures a camera and writes the results to a profile.\n\nUsage: lowlux calibrate KIND [OPTIONS]\n\nKinds:\n");
  for (const Kind& kind : kinds) print_out(fmt::format("  {:<10} {}\n", kind.name, kind.summary));
  print_out(
      "\n`lowlux calibrate KIND --help` lists a kind's options. `lowlux develop --black PROFILE.json` uses the "
      "profile.\n");
}

std::string profile_text(const CameraProfile& profile) {
  std::string text;
  for (const GainProfile& gain : profile.gains) {
    const SensorModel& s = *gain.sensor;
    text +=
        fmt::format("{}\n  gain {:g} DN/e-, read noise {:g} e-, full well {:g} e-, dark current {:g} e-/s at {:g} C\n",
                    gain.gain_setting.empty() ? s.name : gain.gain_setting, s.system_gain_dn_per_e, s.read_noise_e,
                    s.full_well_e, s.dark_current_e_per_s[1], s.dark_temperature_c);
    for (const Provenance& p : gain.provenance) text += fmt::format("  {}: {}\n", p.figures, p.source);
  }
  return text;
}

/// Returns the profile that a tuning file of libcamera's Raspberry Pi pipelines describes. The file is named after its
/// sensor, "imx477.json".
Result<CameraProfile> profile_of_file(const std::string& file) {
  const std::string name = std::filesystem::path(file).filename().string();
  auto sensor = calib::tuned_sensor(name);
  if (!sensor) {
    return fail(ErrorCode::invalid_argument, "a tuning file must be named after a known sensor, such as imx477.json",
                file);
  }
  const auto bytes = capture::read_file_bytes(file, calib::max_tuning_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  const auto tuning = calib::parse_raspberry_tuning({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!tuning) return fail(tuning.error().code, tuning.error().message, file);
  sensor->source = "libcamera, " + name;
  return calib::profile_of_tuning(*tuning, *sensor);
}

Result<CameraProfile> quoted_profile_of(const std::string& sensor) {
  if (has_extension(sensor, ".json")) return profile_of_file(sensor);
  if (auto known = calib::raspberry_profile(sensor)) return *std::move(known);
  auto profile = calib::quoted_profile(sensor);
  if (!profile && profile.error().code == ErrorCode::invalid_argument) {
    profile.error().message +=
        fmt::format("; for Raspberry Pi cameras {}", fmt::join(calib::raspberry_sensors(), ", "));
  }
  return profile;
}

}  // namespace

Result<Calibration> calibrate_quoted(const CalibrateQuotedArgs& args) {
  if (const auto good = check_outputs(args.common); !good) return tl::make_unexpected(good.error());
  auto profile = quoted_profile_of(args.common.frames.front());
  if (!profile) return tl::make_unexpected(profile.error());
  Calibration found;
  found.profile = *std::move(profile);
  found.text = profile_text(found.profile);
  return found;
}

int run_calibrate_quoted(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_quoted(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateQuotedArgs>(parsed);
  const auto found = calibrate_quoted(args);
  return found ? finish(args.common, *found) : calibration_failed(args.common, found.error());
}

int run_calibrate(const std::vector<std::string>& words) {
  const std::string_view first = words.empty() ? std::string_view() : words.front();
  if (first == "--help" || first == "-h" || first == "--help-all") {
    print_help();
    return exit_done;
  }
  if (words.size() == 1 && is_help_form(words.front())) {
    for (const Kind& kind : kinds) kind.run(words);
    return exit_done;
  }
  for (const Kind& kind : kinds) {
    if (kind.name == first) return kind.run({words.begin() + 1, words.end()});
  }
  std::array<std::string_view, kinds.size()> names;
  std::ranges::transform(kinds, names.begin(), &Kind::name);
  const bool is_unnamed = first.empty() || first.starts_with('-');
  const std::string wrong =
      is_unnamed ? fmt::format("the first argument must be one of {}; --help describes them", fmt::join(names, ", "))
                 : fmt::format("unknown kind '{}'{}; --help lists them", first, suggestion(first, names));
  return print_usage_error("calibrate", {ErrorCode::invalid_argument, wrong, {}}, failure_json("calibrate", words));
}

}  // namespace lowlux::cli
