#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::cli {

/// The raw files that an argument names: one file as it is; of a folder the raw files in it by name, not of folders in
/// it; of a pattern (*, ?, [...]) that is not itself a file all that match, by name.
/// Errors: a folder without raw files, a pattern that nothing matches.
Result<std::vector<std::string>> raw_files_of(const std::string& argument);

/// The raw files of an option's arguments, each a list separated by commas unless there is a file of that name.
Result<std::vector<std::string>> raw_files_of_lists(const std::vector<std::string>& arguments);

}  // namespace lowlux::cli
