#include "isp/cli/calibrate_colour_args.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/option_values.h"
#include "isp/cli/output_place.h"
#include "isp/output/image_writer.h"

namespace lowlux::cli {
namespace {

/// What is wrong with the files that would be written; empty if nothing.
std::string wrong_files(const CalibrateColourArgs& args) {
  if (args.output.empty()) return "-o is required: the profile to write";
  if (!args.output.ends_with(".json")) return fmt::format("-o: profiles are .json, not {}", args.output);
  if (!args.report.empty() && !args.report.ends_with(".html")) {
    return fmt::format("--report: reports are .html, not {}", args.report);
  }
  if (!args.overlay.empty()) {
    const auto format = isp::format_of(args.overlay);
    if (!format) return format.error().message;
    const auto fits = isp::check_writable(*format, SampleType::u8, OutputSpace::srgb);
    if (!fits) return fits.error().message;
  }
  return wrong_names({args.output, args.report, args.overlay}, {args.chart});
}

std::string wrong(const CalibrateColourArgs& args) {
  if (args.chart.empty() == args.camera.empty()) {
    return "give a photographed chart, or --camera with spectral sensitivities";
  }
  if (args.chart.empty() && !args.overlay.empty()) return "--overlay: it shows a photographed chart";
  if (args.chart.empty() && args.preserve_white) return "--preserve-white: it is for a photographed chart";
  if (args.chart.empty() && args.even_light) return "--even-light: it is for a photographed chart";
  if (!args.chart.empty() && args.per_photon) return "--per-photon: it is for spectral sensitivities (--camera)";
  return wrong_files(args);
}

}  // namespace

Parsed<CalibrateColourArgs> parse_calibrate_colour(const std::vector<std::string>& words) {
  CLI::App app("A camera's colour matrix from a photographed ColorChecker or from its spectral sensitivities.",
               "lowlux calibrate colour");
  CalibrateColourArgs args;
  app.add_option("CHART", args.chart, "raw file that shows a ColorChecker Classic, whole and once")->type_name("");
  app.add_option("--camera", args.camera,
                 "in place of a chart: spectral sensitivities, by name (`lowlux simulate --list`) or a table of "
                 "wavelength, R, G, B")
      ->type_name("NAME|FILE.csv");
  app.add_flag("--per-photon", args.per_photon, "the table is quantum efficiency, not response per unit of power");
  app.add_option("--illuminant", args.illuminant,
                 "the light on the chart: a CIE illuminant or a lamp, or a table (default: of A, D50, D55, D65 and D75 "
                 "the nearest to the chart's neutral; D50 where the file has no matrix, and with --camera)")
      ->type_name("NAME|FILE.csv");
  app.add_flag("--preserve-white", args.preserve_white, "the grey row's mean colour becomes the light's white exactly");
  app.add_flag("--even-light", args.even_light, "do not fit how the light falls off over the chart");
  app.add_option("-o,--output", args.output, "profile to write")->type_name("PROFILE.json");
  app.add_option("--add-to", args.add_to, "profile whose other figures are kept")->type_name("PROFILE.json");
  app.add_option("--report", args.report, "page with tables and plots")->type_name("PAGE.html");
  app.add_option("--overlay", args.overlay, "picture that shows where patches were measured")->type_name("FILE.png");
  app.add_flag("--force", args.force, "overwrite files that exist");
  app.add_flag("--json", args.json, "one JSON object on stdout");
  if (const auto code = parse_words(app, words)) return *code;
  if (const std::string what = wrong(args); !what.empty()) return refuse(app, what);
  return args;
}

}  // namespace lowlux::cli
