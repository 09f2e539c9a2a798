#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/shared/outputs.h"

namespace lowlux::cli {

/// Names the files that are only read in addition to the raw files of the jobs.
struct CalibrationFiles {
  DarkNames darks;
  std::vector<std::string> flats;
};

/// Returns the calibration files that the arguments name. Errors: those of dark_files and raw_files_of_lists; a flat
/// that is itself among the raw files; an output that would replace any file that is read.
Result<CalibrationFiles> calibration_files(const DevelopArgs& args, const std::vector<Job>& jobs);

}  // namespace lowlux::cli
