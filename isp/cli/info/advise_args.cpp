#include "isp/cli/info/advise_args.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include <CLI/CLI.hpp>

#include "isp/base/file_extension.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/shared/sensor_options.h"

namespace lowlux::cli {
namespace {

constexpr const char* group = "Advice (with --advise)";

void add_optional(CLI::App& app, const char* flag, const char* type, const char* help, std::optional<double>& out) {
  add_number(app, flag, type, help, [&out](double value) { out = value; })->group(group);
}

std::optional<std::string> set_highlight(const std::string& text, AdviseArgs& args) {
  const bool ratio = text.ends_with('x');
  const auto value = quantity_of(text, ratio ? "x" : "cd/m2");
  if (!value) return "is neither a luminance in cd/m2 nor, as 20x, a multiple of the mid tone's";
  (ratio ? args.highlight_ratio : args.highlight_cd_m2) = *value;
  return std::nullopt;
}

void add_camera(CLI::App& app, AdviseArgs& args) {
  app.add_option("--sensor", args.sensor, "sensor by name (`lowlux simulate --list`), or file of a camera profile")
      ->type_name("NAME|PROFILE.json")
      ->group(group);
  app.add_option("--gain", args.gain, "gain setting to use (default: the best one)")
      ->type_name("SETTING")
      ->group(group);
  app.add_option("--camera", args.figures.camera,
                 "camera whose spectral sensitivities are used (default: the sensor's own or a substitute)")
      ->type_name("NAME")
      ->group(group);
  add_optional(app, "--f-number", "f/N", "f-number of the lens (default: the file's; without a file 2)", args.f_number);
  add_optional(app, "--temperature", "C", "temperature of the sensor (default: the file's, or 20)", args.temperature_c);
}

void add_scene(CLI::App& app, AdviseArgs& args) {
  add_optional(app, "--luminance", "CD_M2",
               "luminance of the mid tone (default: the median of the file's green pixels)", args.midtone_cd_m2);
  add_text(app, "--highlight", "CD_M2|RATIOx",
           "luminance that must not clip, in cd/m2 or as a multiple of the mid tone, 20x (default: exceeded by the "
           "fraction --clip of the file's green pixels)",
           [&args](const std::string& text) { return set_highlight(text, args); })
      ->group(group);
  app.add_option("--illuminant", args.light, "light of the scene, by name (default D65)")
      ->type_name("NAME")
      ->group(group);
}

}  // namespace

void add_advise(CLI::App& app, AdviseArgs& args) {
  CLI::Option* wanted = app.add_flag("--advise", args.wanted,
                                     "with --sensor: print the best exposure time and gain; without: print the number "
                                     "and the exposures of frames for lowlux merge")
                            ->group(group);
  add_camera(app, args);
  add_sensor_figures(app, group, args.figures, args.white_luminance_cd_m2);
  add_scene(app, args);
  add_optional(app, "--max-exposure", "S", "longest exposure", args.longest_exposure_s);
  add_optional(app, "--motion", "PX_PER_S", "speed of motion in the scene; with --blur", args.speed_px_per_s);
  add_optional(app, "--blur", "PX", "largest motion blur in pixels; with --motion", args.blur_px);
  add_number(app, "--clip", "FRACTION", "largest fraction of clipped pixels (default 0.001; without --sensor 0.00001)",
             [&args](double share) { args.clipped_fraction = share; })
      ->group(group);
  add_optional(app, "--snr", "DB",
               "without --sensor: signal-to-noise ratio of the darkest tenth after merging (default 20)", args.snr_db);
  add_number(app, "--patch", "PIXELS",
             "number of red pixels in the patch whose chromaticity is predicted (default 256)",
             [&args](double pixels) { args.patch_pixels = pixels; })
      ->group(group);
  app.add_option("--frames", args.frames, "number of frames to be averaged (default 1)")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N")
      ->group(group);
  app.add_option("--report", args.report, "write a page with the curves")->type_name("PAGE.html")->group(group);
  app.add_flag("--force", args.force, "overwrite the page if it exists")->group(group);
  for (CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_group() == group; })) {
    if (option != wanted) option->needs(wanted);
  }
}

namespace {

constexpr const char* needs_sensor = " needs --sensor: a name (`lowlux simulate --list`) or a profile's file";

/// Returns the error of options without a sensor.
std::string validate_bracket(const CLI::App& app, const AdviseArgs& args, std::size_t files) {
  static constexpr std::array<std::string_view, 6> allowed{"--advise", "--snr",    "--max-exposure",
                                                           "--clip",   "--motion", "--blur"};
  for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_group() == group; })) {
    if (option->count() > 0 && std::ranges::find(allowed, option->get_name()) == allowed.end()) {
      return option->get_name() + needs_sensor;
    }
  }
  if (files == 0) return std::string("--advise without a raw file") + needs_sensor;
  if (args.snr_db && !(*args.snr_db >= -20 && *args.snr_db <= 60)) return "--snr is not within -20 to 60 dB";
  if (args.clipped_fraction && !(*args.clipped_fraction >= 1e-9 && *args.clipped_fraction <= 0.5)) {
    return "--clip is not within 1e-9 to 0.5";
  }
  if (args.longest_exposure_s && !(*args.longest_exposure_s > 0)) return "--max-exposure is not above 0";
  return {};
}

}  // namespace

std::string validate_advise(const CLI::App& app, const AdviseArgs& args, std::size_t files) {
  if (!args.wanted) return files == 0 ? "RAW is required" : "";
  if (args.speed_px_per_s.has_value() != args.blur_px.has_value()) return "--motion and --blur must be given together";
  if (args.sensor.empty() && files <= 1) return validate_bracket(app, args, files);
  if (files > 1) return "--advise takes one raw file, or none with --luminance and --highlight";
  if (files == 0 && !args.midtone_cd_m2) return "--advise without a raw file needs --luminance";
  if (files == 0 && !args.highlight_cd_m2 && !args.highlight_ratio) {
    return "--advise without a raw file needs --highlight, as a luminance or as 20x";
  }
  if (args.snr_db) return "--snr and --sensor are mutually exclusive: --snr applies to frames for a merge";
  if (!args.report.empty() && !has_extension(args.report, ".html")) {
    return "--report writes a page, whose name must end with .html, found " + args.report;
  }
  if (!args.longest_exposure_s && !args.speed_px_per_s) {
    return "--advise needs a limit on the exposure time: --max-exposure, or --motion with --blur";
  }
  return {};
}

}  // namespace lowlux::cli
