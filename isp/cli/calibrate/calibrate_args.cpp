#include "isp/cli/calibrate/calibrate_args.h"

#include <filesystem>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/base/file_extension.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

void add_output(CLI::App& app, CalibrateArgs& args) {
  app.add_option("-o,--output", args.output, "profile to write (JSON)")->required()->type_name("PROFILE.json");
  app.add_option("--add-to", args.add_to, "profile to which the measurements are added; they replace its values")
      ->type_name("PROFILE.json");
  app.add_option("--report", args.report, "write a page with tables and plots")->type_name("PAGE.html");
  app.add_flag("--force", args.force, "overwrite files that exist");
  app.add_flag("--json", args.json, "print JSON instead of text");
  app.add_flag("--quiet", args.quiet, "print no warnings and no progress");
}

void add_settings(CLI::App& app, CalibrateArgs& args) {
  const auto setting = [&app](const char* flag, const char* type, const char* help, std::optional<double>& out) {
    add_number(app, flag, type, help, [&out](double value) {
      out = value;
    })->group("Frames that do not state their settings");
  };
  setting("--iso", "ISO", "gain setting of all frames", args.iso);
  setting("--exposure-time", "S", "exposure time of all frames", args.exposure_s);
  setting("--temperature", "C", "temperature of the sensor, for all frames", args.temperature_c);
}

/// Returns the error of the frames' settings; empty if there is none.
std::string settings_error(const CalibrateArgs& args) {
  if (args.iso && *args.iso <= 0) return "--iso must be above 0";
  if (args.exposure_s && *args.exposure_s < 0) return "--exposure-time must not be negative";
  if (args.temperature_c && (*args.temperature_c < -200 || *args.temperature_c > 200)) {
    return "--temperature must be from -200 to 200 C";
  }
  return {};
}

/// Returns the error of the arguments in combination; empty if there is none.
std::string wrong(const CalibrateArgs& args, const std::vector<std::string>& inputs) {
  if (std::string what = settings_error(args); !what.empty()) return what;
  if (!has_extension(args.output, ".json"))
    return "-o: the name of a profile must end with .json, found " + args.output;
  if (!args.report.empty() && !has_extension(args.report, ".html"))
    return "--report: the name of a page must end with .html, found " + args.report;
  return file_name_error({args.output, args.report}, inputs);
}

/// Explains a missing second dark: a shell expands bias/*.dng to several arguments, the option takes the first.
std::string one_dark(const std::string& file) {
  const std::string folder = std::filesystem::path(file).parent_path().string();
  return fmt::format(
      "--darks is {} alone, two or more are needed: give their folder (--darks {}), a quoted pattern or a "
      "list separated by commas",
      file, folder.empty() ? "." : folder + "/");
}

/// Replaces folders, patterns and lists by the raw files that they name. @return the exit code of an error, printed
std::optional<int> expand(const CalibrateArgs& args, std::vector<std::string>& files) {
  auto named = raw_files_of_lists(files, args.quiet);
  if (!named) return print_failure(named.error(), object_if(args.json));
  files = *std::move(named);
  return std::nullopt;
}

}  // namespace

Parsed<CalibrateBlackArgs> parse_calibrate_black(const std::vector<std::string>& words) {
  CLI::App app("Measures pedestal, dark current, its temperature law and hot pixels on dark frames.",
               "lowlux calibrate black");
  app.footer(
      "Frames are grouped by gain, exposure time and temperature. Two exposure times separate dark current from the "
      "pedestal, and two temperatures determine its temperature law. With one exposure time, or one frame, the "
      "pedestal includes the dark signal. The system gain is that of --system-gain, else of --add-to, else it is "
      "measured on the noise of the dark charge.");
  CalibrateBlackArgs args;
  app.add_option("FRAMES", args.common.frames,
                 "dark frames, lens covered: files, a folder or a quoted pattern; with --masked any frames")
      ->required();
  add_output(app, args.common);
  add_settings(app, args.common);
  add_number(app, "--system-gain", "DN_PER_E", "system gain in DN per electron",
             [&args](double value) { args.system_gain_dn_per_e = value; });
  app.add_flag("--masked", args.masked, "measure the masked pixels of the frames instead of the image area");
  app.add_option("--map", args.map,
                 "write each pixel's pedestal and dark current to PREFIX_pedestal.pfm [DN] and "
                 "PREFIX_current.pfm [e-/s] (with the ISO in the name if there are several)")
      ->type_name("PREFIX");
  if (const auto code = parse_arguments(app, words)) return *code;
  if (const auto code = expand(args.common, args.common.frames)) return *code;
  if (args.system_gain_dn_per_e && *args.system_gain_dn_per_e <= 0) return refuse(app, "--system-gain must be above 0");
  if (const std::string what = wrong(args.common, args.common.frames); !what.empty()) return refuse(app, what);
  return args;
}

Parsed<CalibrateNoiseArgs> parse_calibrate_noise(const std::vector<std::string>& words) {
  CLI::App app(
      "Measures system gain, read noise, full well, PRNU and linearity by the photon transfer method of EMVA 1288.",
      "lowlux calibrate noise");
  app.footer(
      "Two flats of the same light form a pair, and a fit needs four pairs of different light. Frames are paired by "
      "gain, exposure time and level, in the given order. All darks have one exposure time, best a short one. Without "
      "--darks the input is one ordinary image, and noise is measured in its even areas.");
  CalibrateNoiseArgs args;
  app.add_option("FRAMES", args.common.frames,
                 "flats in pairs: files, a folder or a quoted pattern; or one ordinary image")
      ->required();
  app.add_option("--darks", args.darks, "two or more dark frames: files, a folder or a quoted pattern; repeatable")
      ->type_name("FILE[,FILE...]|FOLDER")
      ->allow_extra_args(false);
  add_output(app, args.common);
  add_settings(app, args.common);
  app.add_flag("--steady-light", args.steady_light,
               "the light was constant: measure linearity by the exposure times of the flats");
  using Method = calib::PictureNoiseMethod;
  add_choice<Method>(
      app, "--method", {{"ponomarenko", Method::ponomarenko}, {"foi", Method::foi}},
      [&args](Method method) { args.method = method; }, "method of measuring noise on one image (default ponomarenko)");
  if (const auto code = parse_arguments(app, words)) return *code;
  for (std::vector<std::string>* files : {&args.common.frames, &args.darks}) {
    if (const auto code = expand(args.common, *files)) return *code;
  }
  if (args.darks.empty() && args.common.frames.size() > 1) {
    return refuse(app, "several flats need --darks; without --darks, one ordinary image is expected");
  }
  if (args.darks.empty() && args.steady_light) return refuse(app, "--steady-light applies to flats");
  if (!args.darks.empty() && args.method) return refuse(app, "--method applies to one ordinary image, without --darks");
  if (args.darks.size() == 1) return refuse(app, one_dark(args.darks.front()));
  std::vector<std::string> inputs = args.common.frames;
  inputs.insert(inputs.end(), args.darks.begin(), args.darks.end());
  if (const std::string what = wrong(args.common, inputs); !what.empty()) return refuse(app, what);
  return args;
}

namespace {

/// Options of the light of a data sheet. All three are given, or none.
struct LightOptions {
  std::optional<double> irradiance_w_per_m2;
  std::optional<double> wavelength_nm;
  std::optional<double> pixel_pitch_um;

  bool any() const { return irradiance_w_per_m2 || wavelength_nm || pixel_pitch_um; }
  bool all_positive() const {
    const auto positive = [](const std::optional<double>& value) { return value && *value > 0; };
    return positive(irradiance_w_per_m2) && positive(wavelength_nm) && positive(pixel_pitch_um);
  }
  calib::Irradiance light() const {
    return {.w_per_m2 = *irradiance_w_per_m2,
            .wavelength_nm = *wavelength_nm,
            .pixel_um2 = *pixel_pitch_um * *pixel_pitch_um};
  }
};

void add_light(CLI::App& app, LightOptions& light) {
  add_number(app, "--irradiance", "W_PER_M2", "constant irradiance of the sensor: measures quantum efficiency",
             [&light](double value) { light.irradiance_w_per_m2 = value; });
  add_number(app, "--wavelength", "NM", "wavelength of the light of --irradiance",
             [&light](double value) { light.wavelength_nm = value; });
  add_number(app, "--pixel-pitch", "UM", "pixel pitch in micrometres, with --irradiance",
             [&light](double value) { light.pixel_pitch_um = value; });
}

}  // namespace

Parsed<CalibrateSheetArgs> parse_calibrate_sheet(const std::vector<std::string>& words) {
  CLI::App app(
      "Makes a data sheet of a sensor by EMVA 1288 release 4.0, as an HTML page and JSON, from flats and darks.",
      "lowlux calibrate sheet");
  app.footer(
      "Two flats of the same light form a pair. Four or more pairs of different light are needed, and should reach "
      "saturation; 16 flats near half of saturation measure PRNU best. Darks of the shortest exposure time, best 16, "
      "measure DSNU and dark noise. Darks of the exposure times of the flats are subtracted for PRNU and quantum "
      "efficiency. Darks of two or more times and temperatures measure the dark current. All frames must have one gain "
      "setting.");
  CalibrateSheetArgs args;
  LightOptions light;
  app.add_option("FLATS", args.common.frames, "flats: files, a folder or a quoted pattern")->required();
  app.add_option("--darks", args.darks, "dark frames: files, a folder or a quoted pattern; repeatable")
      ->required()
      ->type_name("FILE[,FILE...]|FOLDER")
      ->allow_extra_args(false);
  app.add_option("-o,--output", args.common.output, "page to write; the figures are also written next to it as .json")
      ->required()
      ->type_name("SHEET.html");
  app.add_flag("--steady-light", args.steady_light,
               "the light was constant: measure linearity by the exposure times of the flats");
  add_light(app, light);
  add_settings(app, args.common);
  app.add_flag("--force", args.common.force, "overwrite files that exist");
  app.add_flag("--json", args.common.json, "print the figures as JSON instead of text");
  app.add_flag("--quiet", args.common.quiet, "print no warnings and no progress");
  if (const auto code = parse_arguments(app, words)) return *code;
  for (std::vector<std::string>* files : {&args.common.frames, &args.darks}) {
    if (const auto code = expand(args.common, *files)) return *code;
  }
  if (light.any() && !light.all_positive()) {
    return refuse(app, "--irradiance, --wavelength and --pixel-pitch must be given together, and be above 0");
  }
  if (light.any()) args.irradiance = light.light();
  if (args.darks.size() == 1) return refuse(app, one_dark(args.darks.front()));
  if (!has_extension(args.common.output, ".html"))
    return refuse(app, "-o: the name of a page must end with .html, found " + args.common.output);
  if (const std::string what = settings_error(args.common); !what.empty()) return refuse(app, what);
  std::vector<std::string> inputs = args.common.frames;
  inputs.insert(inputs.end(), args.darks.begin(), args.darks.end());
  const std::string what = file_name_error({args.common.output, json_of_sheet(args.common.output)}, inputs);
  if (!what.empty()) return refuse(app, what);
  return args;
}

Parsed<CalibrateQuotedArgs> parse_calibrate_quoted(const std::vector<std::string>& words) {
  CLI::App app("Makes a profile from the published figures of a sensor; `lowlux simulate --list` lists the sensors.",
               "lowlux calibrate quoted");
  CalibrateQuotedArgs args;
  app.add_option("SENSOR", args.common.frames,
                 "name of the sensor; for Raspberry Pi cameras also imx219, imx477, ... or a tuning file (imx477.json)")
      ->required()
      ->expected(1);
  app.add_option("-o,--output", args.common.output, "profile to write (JSON)")->required()->type_name("PROFILE.json");
  app.add_flag("--force", args.common.force, "overwrite files that exist");
  app.add_flag("--json", args.common.json, "print JSON instead of text");
  if (const auto code = parse_arguments(app, words)) return *code;
  if (const std::string what = wrong(args.common, {}); !what.empty()) return refuse(app, what);
  return args;
}

namespace {

/// Returns the error of the output files; empty if there is none.
std::string wrong_files(const CalibrateColourArgs& args) {
  if (args.output.empty()) return "-o is required: the profile to write";
  if (!has_extension(args.output, ".json"))
    return fmt::format("-o: the name of a profile must end with .json, found {}", args.output);
  if (!args.report.empty() && !has_extension(args.report, ".html")) {
    return fmt::format("--report: the name of a page must end with .html, found {}", args.report);
  }
  if (!args.overlay.empty()) {
    const auto format = isp::format_of(args.overlay);
    if (!format) return format.error().message;
    const auto fits = isp::check_writable(*format, SampleType::u8, OutputSpace::srgb);
    if (!fits) return fits.error().message;
  }
  return file_name_error({args.output, args.report, args.overlay}, {args.chart});
}

std::string wrong(const CalibrateColourArgs& args) {
  if (args.chart.empty() == args.camera.empty()) {
    return "name a raw file that shows a chart, or spectral sensitivities with --camera";
  }
  if (args.chart.empty() && !args.overlay.empty()) return "--overlay applies to a photographed chart, not to --camera";
  if (args.chart.empty() && args.preserve_white)
    return "--preserve-white applies to a photographed chart, not to --camera";
  if (args.chart.empty() && args.even_light) return "--even-light applies to a photographed chart, not to --camera";
  if (!args.chart.empty() && args.per_photon) return "--per-photon requires --camera";
  return wrong_files(args);
}

}  // namespace

Parsed<CalibrateColourArgs> parse_calibrate_colour(const std::vector<std::string>& words) {
  CLI::App app(
      "Determines the colour matrix of a camera from a photographed ColorChecker or from spectral sensitivities.",
      "lowlux calibrate colour");
  CalibrateColourArgs args;
  app.add_option("CHART", args.chart, "raw file of a photograph of one complete ColorChecker Classic")->type_name("");
  app.add_option("--camera", args.camera,
                 "instead of a chart: spectral sensitivities, by name (`lowlux simulate --list`) or a table of "
                 "wavelength, R, G, B")
      ->type_name("NAME|FILE.csv");
  app.add_flag("--per-photon", args.per_photon,
               "the table of --camera is quantum efficiency, not response per unit of power");
  app.add_option("--illuminant", args.illuminant,
                 "light on the chart: a CIE illuminant, a lamp, or a table (default: the one of A, D50, D55, D65, D75 "
                 "that is nearest to the grey patches; D50 with --camera or without a matrix in the file)")
      ->type_name("NAME|FILE.csv");
  app.add_flag("--preserve-white", args.preserve_white,
               "constrain the fit to map the mean of the grey patches exactly to the white of the light");
  app.add_flag("--even-light", args.even_light, "assume even light on the chart instead of fitting its gradient");
  app.add_option("-o,--output", args.output, "profile to write")->type_name("PROFILE.json");
  app.add_option("--add-to", args.add_to, "profile to which the measurements are added; they replace its values")
      ->type_name("PROFILE.json");
  app.add_option("--report", args.report, "write a page with tables and plots")->type_name("PAGE.html");
  app.add_option("--overlay", args.overlay, "write an image that shows where patches were measured")
      ->type_name("FILE.png");
  app.add_flag("--force", args.force, "overwrite files that exist");
  app.add_flag("--json", args.json, "print one JSON object on stdout");
  if (const auto code = parse_arguments(app, words)) return *code;
  if (const std::string what = wrong(args); !what.empty()) return refuse(app, what);
  return args;
}

}  // namespace lowlux::cli
