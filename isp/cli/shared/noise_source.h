#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"

namespace lowlux::cli {

/// Gives a Bayer frame whose noise is to be reduced, and of which neither a profile nor its file states usable noise,
/// that measured on the picture itself, with a warning that says so. Where it cannot be measured the warning says why,
/// and the frame stays as it is. Errors: those of the black point, and where noise has to be reduced (a level was asked
/// for, or DenoiseChoice::always) those of calib::fit_picture_noise.
Result<void> find_noise(const isp::DevelopOptions& options, RawFrame& frame, Executor& executor);

}  // namespace lowlux::cli
