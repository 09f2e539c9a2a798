#pragma once

#include <string>
#include <vector>

namespace lowlux::cli {

/// `calibrate colour`: takes the words after it, prints what it has to say and returns an exit code.
int run_calibrate_colour(const std::vector<std::string>& words);

}  // namespace lowlux::cli
