#pragma once

#include <cstddef>

#include "isp/base/frame.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/frame_tiles.h"

namespace lowlux::isp {

/// Bytes a new Pipeline takes for a frame, to within a few kilobytes: frame and picture themselves left out, which
/// their owners have. Of the frame only layout and rectangles are read.
/// Precondition: the look of the camera, no frames before: NightLookGrid and TemporalMean say what they take.
/// @param threads  of the executor
std::size_t pipeline_bytes(const RawDn& raw, const DevelopPlan& plan, int threads, const TileLimits& limits = {});

/// About the most bytes that developing a frame takes: the frame, its dark frame, its picture, and a Pipeline that
/// reduces the noise as much as the options may ask for. Known before anything is planned.
std::size_t expected_bytes(const RawDn& raw, const DevelopOptions& options, int threads);

}  // namespace lowlux::isp
