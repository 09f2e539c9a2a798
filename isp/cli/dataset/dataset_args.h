#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Selects every count-th sample of a data set, beginning with the number-th.
struct Shard {
  std::uint64_t number = 1;  // 1..count
  std::uint64_t count = 1;   // up to 2^63
};

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
