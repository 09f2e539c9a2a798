#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/cli/config/config_file.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/render/retarget/retarget.h"

namespace lowlux::cli {

/// Holds the arguments of `retarget`, from one image to another.
struct RetargetArgs {
  std::string input;
  std::string output;
  isp::RetargetOptions options;  // `shin` is not set
  std::string coefficients;      // file of a table for Shin's model; empty: the substitute
  std::optional<int> bits;
  int jpeg_quality = 92;
  bool force = false;
  bool json = false;
  bool quiet = false;
  Defaults defaults;  // defaults of the user's file
};

Parsed<RetargetArgs> parse_retarget(const std::vector<std::string>& words);

}  // namespace lowlux::cli
