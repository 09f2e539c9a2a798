#pragma once

#include <string>
#include <vector>

#include "isp/base/shard.h"
#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Holds the arguments of `dataset`.
struct DatasetArgs {
  std::string spec;
  std::string output;  // a folder; created if it does not exist
  Shard shard;
  bool dry_run = false;
  bool force = false;
  bool json = false;
  bool quiet = false;
};

Parsed<DatasetArgs> parse_dataset(const std::vector<std::string>& words);

}  // namespace lowlux::cli
