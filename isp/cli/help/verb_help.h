#pragma once

#include <string_view>
#include <vector>

namespace lowlux::cli {

/// Holds what the options themselves do not state about the help of a verb.
struct VerbHelp {
  std::string_view verb;
  std::vector<std::string_view> front;  // options that --help shows, in order; empty: all that are in no group
  std::vector<std::string_view> examples;
};

/// Returns the help of a verb; for one that is not in the table, no front and no examples.
VerbHelp verb_help(std::string_view verb);

/// Returns the title under which --help-all lists an option that is not in front; empty if it has none of its own.
std::string_view option_group(std::string_view verb, std::string_view option);

}  // namespace lowlux::cli
