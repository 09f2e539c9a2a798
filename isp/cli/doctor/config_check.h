#pragma once

#include <string>
#include <vector>

#include "isp/cli/config/config_file.h"

namespace lowlux::cli {

/// Returns the lines of the user's file that set an option that their verb does not have, with the nearest one that it
/// has: "FILE:2: develop has no option 'exposre' (did you mean exposure?)", separated by "; "; empty if there are none.
/// The command itself is started to list the options of each verb: only the parser of a verb knows them.
std::string unknown_options(const std::vector<ConfigLine>& lines, const std::string& file);

}  // namespace lowlux::cli
