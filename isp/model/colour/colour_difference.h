#pragma once

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Returns the distance in CIELAB (CIE 15:2018 Eq. 8.21).
double delta_e_ab(const Lab& first, const Lab& second);

/// Returns the chromaticity part of Delta E 94 (thesis Eq. 5.15 and 5.16; CIE 116-1995 without lightness, k_C = k_H =
/// 1):
///     sqrt((dC / S_C)^2 + dH^2 / S_H^2),  S_C = 1 + 0.045 C, S_H = 1 + 0.015 C,  C the chroma of the reference,
/// where dH^2 = da^2 + db^2 - dC^2; a value below 0 by rounding counts as 0. The two colours must not be swapped.
double delta_e_94c(const Lab& reference, const Lab& test);

/// Returns the colour difference CIEDE2000 with k_L = k_C = k_H = 1 (ISO/CIE 11664-6:2014, in the form of Sharma, Wu &
/// Dalal, Color Res. Appl. 30 (2005) 21-30, which defines the mean hue of opposite and of grey colours).
double ciede2000(const Lab& first, const Lab& second);

}  // namespace lowlux::isp
