#pragma once

#include <cstddef>

#include "isp/base/frame.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/frame_tiles.h"

namespace lowlux::isp {

/// Returns the bytes that a new Pipeline takes for a frame, to within a few kilobytes, without the frame and the image
/// themselves, which their owners hold. Of the frame only layout and rectangles are read.
/// Precondition: the look of the camera, no previous frames: NightLookGrid and TemporalMean state what they take.
/// @param threads  threads of the executor
std::size_t pipeline_bytes(const RawDn& raw, const DevelopPlan& plan, int threads, const TileLimits& limits = {});

/// Returns about the maximum number of bytes that developing a frame takes: the frame, its dark frame, its image, and a
/// Pipeline that reduces the noise as much as the options may require. Known before anything is planned.
std::size_t expected_bytes(const RawDn& raw, const DevelopOptions& options, int threads);

}  // namespace lowlux::isp
