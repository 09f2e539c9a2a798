#pragma once

#include <optional>

#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Hunt's model of colour vision: the rods' contribution to the achromatic signal (Hunt, The Reproduction of Colour;
// thesis Eq. 2.10 to 2.12 with B_S added, the fourth power of (1 - j^2), and -3.05).

/// Returns F_L = 0.2 k^4 (5 L_A) + 0.1 (1 - k^4)^2 (5 L_A)^(1/3), k = 1 / (5 L_A + 1), the luminance-level adaptation
/// factor of the cones for a luminance of adaptation [cd/m2]; 0 at 0. CIECAM02 and iCAM06 use the same.
double luminance_level_factor(double adaptation_cd_m2);

/// Returns L_AS = 2.26 L_A cbrt(T / 4000 - 0.4), the scotopic luminance of adaptation of a light of T kelvin; the
/// factor is 1 at 5600 K and where T is not known, 0 below 1600 K.
double scotopic_adaptation(double adaptation_cd_m2, std::optional<double> colour_temperature_k);

/// Describes the rods' response in one state of adaptation.
struct RodAdaptation {
  double u = 0;     // 5 L_AS / 2.26
  double j = 0;     // 1e-5 / (u + 1e-5)
  double f_ls = 0;  // 3800 j^2 u + 0.2 (1 - j^2)^4 u^(1/6)
};
/// Returns the rods' state for a scotopic luminance of adaptation.
/// @param scotopic_cd_m2  L_AS, scotopic luminance of the adaptation field, at least 0
RodAdaptation rod_adaptation(double scotopic_cd_m2);

/// Returns B_S = 0.5 / (1 + 0.3 (u s)^0.3) + 0.5 / (1 + 5 u), the rods' response left after bleaching; s = S / S_w >=
/// 0.
double rod_bleaching(const RodAdaptation& rods, double relative_scotopic);

/// Returns f_n(x) = 40 x^0.73 / (x^0.73 + 2), x >= 0.
double hunt_response(double x);

/// Returns A_S = 3.05 B_S f_n(F_LS s) + 0.3; a negative s counts as 0. In L_AS it rises and falls: its peak is near
/// 0.01.
double rod_signal(const RodAdaptation& rods, double relative_scotopic);

/// Returns A = N_bb (A_a - 1 + A_S - 0.3 + sqrt(1 + 0.3^2)), A_a = 2 rho_a + gamma_a + beta_a / 20 - 3.05 + 1.
double hunt_achromatic(double cone_signal, double rod_signal, double background_induction);

/// Returns the model as a map: cones fully adapted to the white in HPE space, rho_a = B f_n(F_L rho / rho_w) + 1 with B
/// = 1e7 / (1e7 + 5 L_A), rods by scotopic_weights. A colour is scaled until its signal above that of black, relative
/// to white's, is the same in daylight (L_A = 318.31 cd/m2).
AppearanceModel hunt_appearance();

}  // namespace lowlux::isp
