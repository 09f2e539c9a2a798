#pragma once

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Returns the samples per pixel of a layout.
constexpr int samples_of(SensorLayout layout) { return layout == SensorLayout::linear_rgb ? 3 : 1; }

/// Returns an error of code invalid_argument, naming the tag, unless the frame is consistent and DNG tags can hold its
/// figures: rectangles inside one another, as many figures as there are sites, columns and rows, levels of 0 to 65535
/// DN (of floating-point samples to 4294967295, white an integer) with white above black, matrices that are regular as
/// rationals, positive gains, noise ratios in blocks that cover the active area, and no sample that unusable_sample
/// names.
Result<void> check_dng_frame(const RawFrame& frame);

}  // namespace lowlux::isp
