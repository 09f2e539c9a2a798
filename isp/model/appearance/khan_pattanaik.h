#pragma once

#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// The blue shift of moonlit scenes by rod signals in S cones (Khan & Pattanaik 2004; thesis Eq. 2.16). Responses are
// those of Hunt in the form of Pattanaik et al. 2000, R = B I^n / (I^n + sigma^n), n = 0.73.

inline constexpr double moonlight_adaptation_cd_m2 = 0.03;  // G of the paper
inline constexpr double rod_fraction_of_s_cones = 0.20;     // fraction of the rods' response added to the S cones'

/// Holds half-saturation and bleaching of one class of receptors.
struct NakaRushton {
  double half_saturation = 0;  // sigma, in the unit of the intensity
  double bleaching = 0;        // B
};

/// Returns the rods' sigma = 2.5874 G / (19000 j^2 G + 0.2615 (1 - j^2)^4 G^(1/6)), j = 1 / (5e5 G + 1), B = 0.04 /
/// (0.04 + G).
/// @param adaptation_cd_m2  G > 0
NakaRushton khan_rods(double adaptation_cd_m2);
/// Returns the cones' sigma = 12.9223 G / (k^4 G + 0.171 (1 - k^4)^2 G^(1/3)), k = 1 / (5 G + 1), B = 2e6 / (2e6 + G).
NakaRushton khan_cones(double adaptation_cd_m2);

/// Returns R(I); 0 for an intensity that is not positive.
double khan_response(const NakaRushton& receptor, double intensity);
/// Returns I(R), the inverse of khan_response for 0 <= R < B; a response within 1e-9 of B counts as that far from it.
double khan_intensity(const NakaRushton& receptor, double response);

/// Returns the excitation of S cones [cd/m2 of a white] equivalent to rods at a scotopic luminance [cd/m2]: 0.20 of the
/// rods' response, inverted as a cone's response. Both are adapted to moonlight.
double khan_s_cone_excitation(double scotopic_cd_m2);

/// Returns the model as a map. The paper's eye is scotopic: no cones, and S cones driven by rods. Here the state m of
/// CIE 191 mixes it with daylight, and luminance comes from L_mes, which the paper does not specify:
///     L_mes white + m (colour - Y white) + (1 - m) S of rods,   relative to the white's
AppearanceModel khan_pattanaik_appearance();

}  // namespace lowlux::isp
