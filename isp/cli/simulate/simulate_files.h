#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Holds the files of a run: all frames, then the truths. Names are empty where a file is not written.
struct SimulateFiles {
  std::vector<std::string> frames;
  std::string truth;
  std::string truth_electrons;
  std::string burst_truth;  // motion and exposures of a burst
};

/// Returns whether there is a truth; of a dark frame, whose truth is black, only where its file is named.
bool has_truth(const SimulateArgs& args);

/// Returns the files that the arguments ask for; without an output, names of frames are empty.
SimulateFiles files_of(const SimulateArgs& args);

/// Returns the error of the output files by their names; empty if there is none.
std::string wrong_files(const SimulateArgs& args);

/// Checks before any work that no output exists. A run that fails later (a full disk) or is interrupted leaves the
/// frames that were finished, each of them complete.
Result<void> check_output_is_free(const SimulateFiles& files, const SimulateArgs& args);

}  // namespace lowlux::cli
