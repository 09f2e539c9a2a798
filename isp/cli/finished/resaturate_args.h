#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Holds the arguments of `resaturate`, from one image to another. Exactly one of the two black points is set.
struct ResaturateArgs {
  std::string input;
  std::string output;
  std::optional<std::array<double, 3>> black_codes;  // sRGB, 0..255
  std::optional<Rect> black_area;                    // in the upright image
  std::optional<double> chroma_noise;                // relative to white
  double prior_std = 0.065;
  int radius = 4;
  std::optional<int> bits;
  int jpeg_quality = 92;
  bool force = false;
  bool json = false;
  bool quiet = false;
  Defaults defaults;  // defaults of the user's file
};

Parsed<ResaturateArgs> parse_resaturate(const std::vector<std::string>& words);

}  // namespace lowlux::cli
