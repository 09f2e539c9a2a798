#pragma once

#include <optional>
#include <string>

#include "isp/pipeline/merge/merged_raw.h"

namespace CLI {
class App;
}

namespace lowlux::cli {

/// Holds the options of merging, for `merge` and `develop --merge`.
struct MergeArgs {
  isp::MergeOptions options;
  std::string reference;  // one of the inputs; empty: the first, with stars the middle one
  std::optional<double> drizzle_scale;
  std::optional<double> pixfrac;
};

/// Adds the options of merging.
void add_merging(CLI::App& app, MergeArgs& args);

/// Sets the options of merging that depend on several of the command's.
/// @param budgeted  the command has a time budget
/// @return what is wrong with them
std::optional<std::string> settle_merging(MergeArgs& args, bool budgeted);

}  // namespace lowlux::cli
