#pragma once

#include "denoise/denoise_options.h"
#include "isp/base/frame.h"
#include "isp/raw/measure/thumbnail.h"

/// Frames whose noise differs from place to place: RawFrame::noise_ratio.
namespace lowlux::isp {

/// Returns the mean noise ratio of a block of a thumbnail; 1 where the frame has none.
double ratio_of_block(const RawFrame& frame, const Thumbnail& thumbnail, int column, int row);

/// Returns the noise of the median block of the frame, dark charge as if it were in it.
denoise::RawNoise median_noise(const RawFrame& frame, denoise::RawNoise noise);

}  // namespace lowlux::isp
