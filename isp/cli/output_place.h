#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::cli {

/// What would keep a file from being written, known before any work is done; the writers look again.
/// Errors: its folder is missing; it is a folder itself; it exists, and `force` is not given.
Result<void> check_place(const std::string& file, bool force);

/// Whether two names are those of one file.
bool same_name(const std::string& a, const std::string& b);

/// What is wrong with files by their names alone: an output that is another output or an input, an input that is given
/// twice. Empty names are none. @return empty if nothing is wrong
std::string wrong_names(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

}  // namespace lowlux::cli
