#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/hunt.h"

namespace lowlux::isp {

// The lightness predictor of Kwak, MacDonald & Luo 2003 (thesis Eq. 2.13 to 2.15): CIECAM02's achromatic signal and
// alpha times Hunt's rod signal. No value of alpha is published.

inline constexpr double kwak_rod_weight = 1;      // alpha: chosen, not published
inline constexpr double average_surround = 0.69;  // c of CIECAM02; 0.59 dim, 0.525 dark

/// Returns 400 x^0.42 / (x^0.42 + 27.13), x = F_L R / 100, odd: CIECAM02's compression of a cone response (white near
/// 100), without its 0.1.
double ciecam02_response(double level_factor, double cone);

/// Returns A = A_a + alpha A_S, A_a = 2 R'_a + G'_a + 0.05 B'_a (the noise of 0.305 subtracted).
/// @param hpe  cone responses of Hunt, Pointer and Estevez, those of white near 100
double kwak_achromatic(double level_factor, const Vector3& hpe, double rod_signal, double alpha = kwak_rod_weight);

/// Returns J_sp = 100 (A / A_w)^(c z), z = 1.48 + sqrt(Y_b / Y_w); 0 where A is not positive. A_w > 0.
double kwak_lightness(double achromatic, double achromatic_white, double relative_background, double surround);

/// Returns the model as a map: cones fully adapted to the white in HPE space. A colour is scaled until its A above that
/// of black, relative to white's, is the same in daylight (L_A = 318.31 cd/m2); c z cancels.
AppearanceModel kwak_appearance();

}  // namespace lowlux::isp
