#pragma once

#include <string>
#include <vector>

#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Holds the arguments of `compare`: two images.
struct CompareArgs {
  std::string reference;
  std::string test;
  bool json = false;
};

Parsed<CompareArgs> parse_compare(const std::vector<std::string>& words);

}  // namespace lowlux::cli
