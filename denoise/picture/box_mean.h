#pragma once

#include "isp/base/plane.h"

namespace lowlux::denoise {

/// Means over squares of 2 radius + 1 pixels, cut off at the picture's edges. NaN marks a pixel without a value: it is
/// left out of the means, as are infinities, and comes out where a square holds no value. Every mean is summed anew, so
/// that large values leave nothing behind in others.
/// @param radius  0 (a copy) to 64
Plane<double> box_mean(const Plane<double>& values, int radius);

}  // namespace lowlux::denoise
