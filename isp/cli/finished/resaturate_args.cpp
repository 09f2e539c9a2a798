#include "isp/cli/finished/resaturate_args.h"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

std::optional<std::string> set_codes(const std::string& text, ResaturateArgs& args) {
  const auto codes = numbers_of(text, 3);
  if (!codes || codes->size() != 3 || !std::ranges::all_of(*codes, [](double c) { return c >= 0 && c <= 255; })) {
    return "is not three codes from 0 to 255";
  }
  args.black_codes = {(*codes)[0], (*codes)[1], (*codes)[2]};
  return std::nullopt;
}

std::optional<std::string> set_area(const std::string& text, ResaturateArgs& args) {
  constexpr double most = 1e6;
  const auto numbers = numbers_of(text, 4);
  const auto whole = [](double n) { return n >= 0 && n <= most && n == static_cast<int>(n); };
  if (!numbers || numbers->size() != 4 || !std::ranges::all_of(*numbers, whole) || (*numbers)[2] < 1 ||
      (*numbers)[3] < 1) {
    return "is not left, top, width and height in pixels";
  }
  const auto at = [&](std::size_t i) { return static_cast<int>((*numbers)[i]); };
  args.black_area = Rect{at(0), at(1), at(2), at(3)};
  return std::nullopt;
}

}  // namespace

Parsed<ResaturateArgs> parse_resaturate(const std::vector<std::string>& words) {
  CLI::App app(
      "Restores colour lost to dark current in a finished image. Noise and luminance are not changed. If the raw file "
      "exists, use `develop` or `denoise` instead: they subtract the dark charge.",
      "lowlux resaturate");
  ResaturateArgs args;
  app.add_option("IMAGE", args.input, "image (PNG, JPEG, TIFF, OpenEXR, PFM, PPM)")->required();
  app.add_option("-o,--output", args.output, "image to write (.png .jpg .tif .exr .pfm)")->required()->type_name("OUT");
  add_text(app, "--black", "R,G,B", "black point: sRGB codes, 0 to 255, of areas without light",
           [&args](const std::string& text) { return set_codes(text, args); });
  add_text(app, "--black-area", "X,Y,WIDTH,HEIGHT", "black point: the mean of this area of the image, in pixels",
           [&args](const std::string& text) { return set_area(text, args); });
  add_text(app, "--chroma-noise", "FRACTION",
           "standard deviation of the chroma of a pixel, relative to white; larger values fade more colour (default: "
           "measured on the image)",
           store_within({0, 1}, args.chroma_noise));
  add_text(app, "--prior", "STD", "expected standard deviation of the chromaticities x and y of scenes (default 0.065)",
           store_within({0.001, 1}, args.prior_std));
  app.add_option("--radius", args.radius, "radius of the average of brightness in pixels (default 4)")
      ->check(CLI::Range(0, 64));
  add_bits(app, args.bits);
  app.add_option("--quality", args.jpeg_quality, "JPEG quality, 1 to 100 (default 92)")->check(CLI::Range(1, 100));
  app.add_flag("--force", args.force, "overwrite a file that exists");
  app.add_flag("--json", args.json, "print JSON instead of text");
  app.add_flag("--quiet", args.quiet, "print no warnings and no text");
  if (const auto code = parse_arguments(app, words, &args.defaults)) return *code;
  if (args.black_codes.has_value() == args.black_area.has_value()) {
    return refuse(app, "give either --black R,G,B or --black-area, an area without light");
  }
  return args;
}

}  // namespace lowlux::cli
