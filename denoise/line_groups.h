#pragma once

#include <span>
#include <vector>

#include "denoise/line_noise.h"
#include "isp/base/plane.h"

/// Parts of lines that are compared with the same parts of other lines.
namespace lowlux::denoise {

inline constexpr int segments = 8;  // of a line, each in two groups: even and odd places, whose colours differ
inline constexpr int groups = 2 * segments;

/// Means of the groups of pixels of every line: as wide as there are lines, `groups` high. NaN for a group without
/// finite values.
Plane<double> group_means(PlaneView<const float> pixels, Lines lines);

/// Each line's difference from the one `distance` before it, as the median over their groups: of lines `distance` and
/// on, the first left out. NaN where no group has both.
/// @param means  as group_means() gives them
std::vector<double> differences(const Plane<double>& means, int distance);

/// The median of what is finite; NaN if nothing is. Reorders.
double median_of(std::span<double> values);

}  // namespace lowlux::denoise
