#pragma once

#include <string>

#include "isp/base/result.h"

namespace lowlux::cli {

/// What would keep a file from being written, known before any work is done; the writers look again.
/// Errors: its folder is missing; it is a folder itself; it exists, and `force` is not given.
Result<void> check_place(const std::string& file, bool force);

}  // namespace lowlux::cli
