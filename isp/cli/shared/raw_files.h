#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::cli {

/// Returns the raw files that an argument names: for a file that file; for a folder all entries by name that have the
/// extension of a raw file, also those that are not files, so that reading them fails; for a pattern (*, ?, [...]) that
/// is not itself a file all matches, by name. Raw files in sub-folders are not among them; a warning is printed if
/// there are any.
/// Errors: a folder without raw files, a pattern without matches.
/// @param quiet  print no warning
Result<std::vector<std::string>> raw_files_of(const std::string& argument, bool quiet = false);

/// Returns the raw files of an option's arguments, each a list separated by commas unless there is a file of that name.
/// @param quiet  print no warning
Result<std::vector<std::string>> raw_files_of_lists(const std::vector<std::string>& arguments, bool quiet);

}  // namespace lowlux::cli
