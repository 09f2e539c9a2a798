#pragma once

#include <array>
#include <string>

#include "isp/base/noise_ratio.h"

namespace lowlux::cli {

/// Returns the smallest, the median and the largest ratio of the blocks.
std::array<double, 3> ratio_range(const NoiseRatio& ratio);

/// Returns the range as text: "0.13 to 1 times this variance in blocks of 8 px, median 0.15".
std::string ratio_text(const NoiseRatio& ratio);

}  // namespace lowlux::cli
