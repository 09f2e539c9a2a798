#pragma once

#include <string>
#include <vector>

#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/calibrate/calibrate_colour_work.h"

namespace lowlux::cli {

/// Calibrates colour from a chart or spectral sensitivities, and writes profile, report and overlay; without an output
/// none of them. Errors: those of colour_from_chart and colour_from_spectra, and of writing.
Result<ColourOutcome> calibrate_colour(const CalibrateColourArgs& args, Executor& executor);

/// Returns the profile to start from with the new colours, which replace those under the same illuminant.
Result<CameraProfile> colour_profile(const CalibrateColourArgs& args, const ColourOutcome& outcome);

/// Runs `calibrate colour`: takes the arguments after it, prints its results and returns an exit code.
int run_calibrate_colour(const std::vector<std::string>& words);

}  // namespace lowlux::cli
