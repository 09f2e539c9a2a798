#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::cli {

/// Returns the raw files that an argument names: for a file that file; for a folder the raw files in it by name,
/// without sub-folders; for a pattern (*, ?, [...]) that is not itself a file all matches, by name.
/// Errors: a folder without raw files, a pattern without matches.
Result<std::vector<std::string>> raw_files_of(const std::string& argument);

/// Returns the raw files of an option's arguments, each a list separated by commas unless there is a file of that name.
Result<std::vector<std::string>> raw_files_of_lists(const std::vector<std::string>& arguments);

}  // namespace lowlux::cli
