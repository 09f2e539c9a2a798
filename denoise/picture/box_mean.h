#pragma once

#include "isp/base/plane.h"

namespace lowlux::denoise {

/// Returns means over squares of 2 radius + 1 pixels, cropped at the image's edges. NaN marks a pixel without a value:
/// NaN and infinities are excluded from the means, and the mean is NaN where a square holds no value. Every mean is
/// summed anew, so that large values leave no rounding error in others.
/// @param radius  0 (a copy) to 64
Plane<double> box_mean(const Plane<double>& values, int radius);

}  // namespace lowlux::denoise
