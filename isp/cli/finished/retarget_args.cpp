#include "isp/cli/finished/retarget_args.h"

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

CLI::Option* add_luminance(CLI::App& app, const std::string& flag, const std::string& help, double& store) {
  return add_number(app, flag, "CD_M2", help, [&store](double given) { store = given; });
}

void add_model(CLI::App& app, RetargetArgs& args) {
  Names<isp::RetargetMethod> methods;
  for (const auto& [method, name] : isp::retarget_methods) methods.emplace(name, method);
  add_choice(
      app, "--model", methods, [&args](isp::RetargetMethod method) { args.options.method = method; },
      "method (default: constrained)");
  app.add_option(
         "--coefficients", args.coefficients,
         "coefficients of Shin's model: lines of E, alpha, beta, l, a, m, b (default: the substitute SHIN-SUB-1)")
      ->type_name("FILE");
  const Names<isp::ShinUnits> units{{"lux", isp::ShinUnits::lux}, {"luminance", isp::ShinUnits::luminance_as_is}};
  add_choice(
      app, "--units", units, [&args](isp::ShinUnits unit) { args.options.units = unit; },
      "unit of E in the coefficients: illuminance of white in lux, or its luminance in cd/m2 (default lux)");
}

}  // namespace

Parsed<RetargetArgs> parse_retarget(const std::vector<std::string>& words) {
  CLI::App app(
      "Adapts an image to a dim display: increases colour, because the eye perceives less colour in dim light.",
      "lowlux retarget");
  RetargetArgs args;
  app.add_option("IMAGE", args.input, "image (PNG, JPEG, TIFF, OpenEXR, PFM, PPM)")->required();
  app.add_option("-o,--output", args.output, "image to write (.png .jpg .tif .exr .pfm)")->required()->type_name("OUT");
  add_luminance(app, "--source-luminance", "luminance of white for which the image was made (default 250)",
                args.options.source_cd_m2);
  add_luminance(app, "--display-luminance", "luminance of the display's white (default 2)", args.options.display_cd_m2);
  add_luminance(app, "--display-black", "luminance of the display's black (default 0)",
                args.options.display_black_cd_m2);
  add_model(app, args);
  add_bits(app, args.bits);
  app.add_option("--quality", args.jpeg_quality, "JPEG quality, 1 to 100 (default 92)")->check(CLI::Range(1, 100));
  app.add_flag("--force", args.force, "overwrite a file that exists");
  app.add_flag("--json", args.json, "print JSON instead of text");
  app.add_flag("--quiet", args.quiet, "print no warnings and no text");
  if (const auto code = parse_arguments(app, words, &args.defaults)) return *code;
  if (const auto possible = isp::retargeting(args.options); !possible) return refuse(app, possible.error().message);
  if (isp::coefficients_name(args.options).empty() && (!args.coefficients.empty() || app.count("--units") > 0)) {
    return refuse(app, "--coefficients and --units: the model " + std::string(isp::name_of(args.options.method)) +
                           " has no coefficients");
  }
  return args;
}

}  // namespace lowlux::cli
