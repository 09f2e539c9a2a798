#pragma once

#include <array>

#include "isp/base/frame.h"

namespace lowlux::isp {

/// Returns the level at which the sensor saturates as fractions of white of R, G and B, as far as the frame shows it:
/// 0.75 to 1.25, more where channels have levels of their own. A source may state a white level above or below.
/// Saturated pixels have one code in common, or, of linear_rgb, one for each channel: the most frequent one of the
/// upper quarter of the range, if it is at least 5 times as frequent as the mean of the codes within 8 of it that occur
/// at all, and is found in 32 pixels and 1 of 20000. Without one, and for floating-point samples, 1.
std::array<double, 3> measure_saturation(const RawDn& raw, const BlackPoint& black);

}  // namespace lowlux::isp
