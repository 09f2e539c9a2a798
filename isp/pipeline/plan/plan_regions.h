#pragma once

#include <optional>
#include <vector>

#include "isp/base/frame.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

inline constexpr int region_px = 1024;  // side of a region

/// Plans less work for the regions of a frame that need less: for each region the cheapest level that stays below the
/// tolerance there, `most` where none does. Returns nullopt where that saves less than a tenth of the noise reduction's
/// time, as estimated from the levels' usual times and the margins of the tiles, or where the frame is one region.
/// @param active  active of the frame
/// @param most    level of the frame as a whole
std::optional<NoiseRegions> plan_regions(const Rect& active, const std::vector<VisibilityBlock>& blocks,
                                         denoise::Level most, double tolerance_delta_e);

}  // namespace lowlux::isp
