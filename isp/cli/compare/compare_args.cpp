#include "isp/cli/compare/compare_args.h"

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {

Parsed<CompareArgs> parse_compare(const std::vector<std::string>& words) {
  CLI::App app(
      "Compares image B with image A, the reference: colour differences Delta E ab, Delta E 94c (chromaticity only) "
      "and CIEDE2000 of every pixel; EGR, the fraction of A's colours that B has; PSNR and SSIM of sRGB codes. Both "
      "images are read by their own ICC profile or chromaticities; white is 1, also for floats. For measurement, "
      "develop with --tone none --exposure 0 --space linear-srgb.",
      "lowlux compare");
  CompareArgs args;
  app.add_option("A", args.reference, "reference image (PNG, JPEG, TIFF, OpenEXR, PFM, PPM)")->required();
  app.add_option("B", args.test, "image of the same size")->required();
  app.add_flag("--json", args.json, "print JSON instead of text");
  if (const auto code = parse_arguments(app, words)) return *code;
  return args;
}

}  // namespace lowlux::cli
