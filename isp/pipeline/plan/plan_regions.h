#pragma once

#include <optional>
#include <vector>

#include "isp/base/frame.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

inline constexpr int region_px = 1024;  // of a side

/// Less work for the parts of a frame that call for less: for each region the cheapest level that stays below the
/// tolerance there, `most` where none does. Nullopt where that saves less than a tenth of the noise reduction's time,
/// as far as the levels' usual ones and the margins of the parts tell, or where the frame is one region.
/// @param active  of the frame
/// @param most    that of the frame as a whole
std::optional<NoiseRegions> plan_regions(const Rect& active, const std::vector<SeenBlock>& blocks, denoise::Level most,
                                         double tolerance_delta_e);

}  // namespace lowlux::isp
