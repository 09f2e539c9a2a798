#pragma once

namespace lowlux::isp {

/// Contrast sensitivity of the eye, 1 over the least modulation that is seen (Barten, Proc. SPIE 5294 (2003) 231-238,
/// Eq. 11):
///     S = 5200 exp(-0.0016 u^2 (1 + 100/L)^0.08) / sqrt((1 + 144/X^2 + 0.64 u^2) (63/L^0.83 + 1/(1 - exp(-0.02 u^2))))
/// @param cycles_per_degree  u > 0
/// @param luminance_cd_m2    L; 0 where it is not above 0, and where it is not a number
/// @param field_deg          X > 0, the side of the field of view
double barten_sensitivity(double cycles_per_degree, double luminance_cd_m2, double field_deg);

/// The least modulation seen at 2 cycles per degree in a field of 10 degrees, scaled to 0.41 % at 100 cd/m2 (Wanat &
/// Mantiuk 2014), at most 0.999.
double threshold_contrast(double luminance_cd_m2);

/// The same as half the logarithm of the ratio of the brightest to the darkest, log10((1 + M) / (1 - M)) / 2.
double threshold_log_contrast(double luminance_cd_m2);

}  // namespace lowlux::isp
