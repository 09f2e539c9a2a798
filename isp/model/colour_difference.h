#pragma once

#include "isp/model/colorimetry.h"

namespace lowlux::isp {

/// Colour difference CIEDE2000 with k_L = k_C = k_H = 1 (ISO/CIE 11664-6:2014, in the form of Sharma, Wu & Dalal,
/// Color Res. Appl. 30 (2005) 21-30, which settles the mean hue of opposite and of grey colours).
double ciede2000(const Lab& first, const Lab& second);

}  // namespace lowlux::isp
