#pragma once

#include "isp/base/result.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/pipeline/merge/merge_context.h"

namespace lowlux::isp {

/// Averages the frames of a camera at rest. Each is compared with the robust mean of the reference and of up to four
/// frames from all over the sequence (merge::make_static_reference). Errors: those of reading. Where a frame's exposure
/// differs, the mean is unfinished, and FrameLoader::exposures_differ() is set.
Result<merge::MosaicMean> static_mean(MergeContext& work);

}  // namespace lowlux::isp
