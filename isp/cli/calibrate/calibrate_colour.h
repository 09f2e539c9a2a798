#pragma once

#include <string>
#include <vector>

namespace lowlux::cli {

/// Runs `calibrate colour`: takes the arguments after it, prints its results and returns an exit code.
int run_calibrate_colour(const std::vector<std::string>& words);

}  // namespace lowlux::cli
