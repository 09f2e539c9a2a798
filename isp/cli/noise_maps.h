#pragma once

#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/cli/pixel_map.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::cli {

/// Where the maps of a picture go: OUT.noise.pfm and OUT.confidence.pfm for OUT.png.
std::vector<std::string> noise_map_names(const std::string& picture);

/// The maps as their picture lies: cropped and upright, one pixel for each 2x2 cell. None if `maps` is empty.
std::vector<PixelMap> noise_map_files(isp::NoiseMaps maps, const RawDn& raw, const std::string& picture,
                                      Executor& executor);

}  // namespace lowlux::cli
