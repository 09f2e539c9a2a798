#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/profile/quoted_profile.h"
#include "isp/cli/calibrate/calibrate_colour.h"
#include "isp/cli/calibrate/calibration.h"
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
    Kind{"noise", "gain, read noise, full well from flats, or noise from one picture", run_calibrate_noise},
    Kind{"quoted", "the profile of a sensor whose figures are published", run_calibrate_quoted},
};

void print_help() {
  print_out(
      "Measures a camera and writes what was found to a profile.\n\nusage: lowlux calibrate KIND [OPTIONS]\n\n"
      "kinds:\n");
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

}  // namespace

int run_calibrate_quoted(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_quoted(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateQuotedArgs>(parsed);
  if (const auto good = check_outputs(args.common); !good) return calibration_failed(args.common, good.error());
  const auto profile = calib::quoted_profile(args.common.frames.front());
  if (!profile) return calibration_failed(args.common, profile.error());
  Calibration found;
  found.profile = *profile;
  found.text = profile_text(*profile);
  return finish(args.common, found);
}

int run_calibrate(const std::vector<std::string>& words) {
  const std::string_view first = words.empty() ? std::string_view() : words.front();
  if (first == "--help" || first == "-h") {
    print_help();
    return exit_done;
  }
  for (const Kind& kind : kinds) {
    if (kind.name == first) return kind.run({words.begin() + 1, words.end()});
  }
  std::array<std::string_view, kinds.size()> names;
  std::ranges::transform(kinds, names.begin(), &Kind::name);
  print_err(fmt::format(
      "{}\n",
      one_line(first.empty() ? fmt::format("lowlux calibrate: name what to calibrate: {}; --help describes them",
                                           fmt::join(names, ", "))
                             : fmt::format("lowlux calibrate: unknown kind '{}'{}; --help lists them", first,
                                           suggestion(first, names)))));
  return exit_usage;
}

}  // namespace lowlux::cli
