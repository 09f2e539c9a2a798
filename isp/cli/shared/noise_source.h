#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"

namespace lowlux::cli {

/// Measures the noise of a Bayer frame on the image itself where noise is to be reduced and neither a profile nor its
/// file states usable noise, and adds a warning. If it cannot be measured, the warning gives the reason, and the frame
/// is unchanged. Errors: those of the black point, and where noise has to be reduced (a level was requested, or
/// DenoiseChoice::always) those of calib::fit_picture_noise.
Result<void> find_noise(const isp::DevelopOptions& options, RawFrame& frame, Executor& executor);

}  // namespace lowlux::cli
