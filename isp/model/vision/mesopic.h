#pragma once

#include "isp/base/matrix3.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Gives the maximum luminous efficacy K'_m of scotopic vision (CIE 1951), with its rounding in CIE 191:2010.
inline constexpr double scotopic_efficacy_lm_w = 1700;
/// Gives V'(555 nm) of CIE 191:2010, 683 / 1699.
inline constexpr double scotopic_at_555_nm = 683.0 / 1699.0;
/// Gives S/P of the equal-energy light, 1 nm sums, in the rounding that Hunt and the mesopic literature use.
inline constexpr double scotopic_ratio_of_equal_energy = 2.26;

/// Holds the photopic and scotopic luminance of one field [cd/m2]; the second in scotopic cd/m2.
struct LuminancePair {
  double photopic = 0;
  double scotopic = 0;
};

/// Describes the adaptation state of the eye between rods and cones, and the mesopic luminance of the field.
struct MesopicState {
  double m = 0;                // coefficient of adaptation of CIE 191: 0 scotopic, 1 photopic
  double luminance_cd_m2 = 0;  // L_mes
};

/// Returns the state of the system MES2 of CIE 191:2010. It is the root of
///     m = clamp(a + b log10 L(m), 0, 1),   L(m) = (m L_p + (1 - m) L_s v0) / (m + (1 - m) v0)
/// with a = 0.7670, b = 0.3334, v0 = scotopic_at_555_nm, found by a safeguarded Newton iteration. The plain iteration
/// of CIE 191 enters a cycle of two for S/P of 18 and above; for S/P below 0.265 there can be three roots: the result
/// is then 0 if the field is below the threshold at m = 0, else the root the bracket [0, 1] leads to, and it jumps
/// between them.
/// @param adaptation  of the field the eye is adapted to. Negative or not a number counts as 0, infinite as 1e30;
///     both 0: m = 0, luminance 0
MesopicState mesopic_state(const LuminancePair& adaptation);

/// Returns a + b log10 L of mesopic_state, not clamped to 0..1. @param luminance_cd_m2  above 0
double mes2_response(double luminance_cd_m2);

/// Returns L(m) of mesopic_state: the mesopic luminance of a stimulus for an eye in state m, 0..1. Linear in the
/// stimulus, so signed figures are allowed.
double mesopic_luminance_cd_m2(double m, const LuminancePair& stimulus);

/// Returns the rods' fraction r of the mesopic luminance: L(m) = L_p + r (L_s - L_p), r = (1 - m) v0 / (m + (1 - m)
/// v0).
double rod_fraction(double m);

/// Returns V'(lambda) of CIE 1951, peak 1, 380 to 780 nm in steps of 1 nm, 0 elsewhere.
const Spectrum& scotopic_observer();

/// Returns the exact luminances of a spectral radiance [W m-2 sr-1 nm-1].
LuminancePair luminance_of(const Spectrum& radiance);

/// Gives the weights of X, Y and Z in scotopic luminance. V' is not in the span of the colour-matching functions: this
/// least squares fit over 4000 smooth reflectances under nine lights (S/P 0.37 to 9) is off by 0.4 % in the mean and
/// 9.3 % rms; its S/P of D65 is 2.457 (exactly 2.463), of illuminant A 1.427 (1.412). Lamps of few lines differ from
/// smooth lights of their chromaticity: it is 50 % too high under high-pressure sodium (`bench --stage scene-light`).
inline constexpr Vector3 scotopic_weights{-1.52356, 2.71012, 1.09735};

/// Returns the scotopic luminance estimated from tristimulus values, by scotopic_weights; at least 0.
double scotopic_luminance(const Xyz& colour);
/// Returns the scotopic luminance estimated by Y (1.33 (1 + (Y + Z) / X) - 1.68) (Ward Larson, Rushmeier & Piatko, IEEE
/// TVCG 3 (1997)): 10.5 % rms; where X is not above 1e-9, by scotopic_luminance(). At least 0.
double scotopic_luminance_ward(const Xyz& colour);

/// Returns the diameter of the pupil, 4.9 - 3 tanh(0.4 (log10 L + 1)) (Moon & Spencer 1944); 7.9 mm at L = 0.
double pupil_diameter_mm(double luminance_cd_m2);
/// Returns the retinal illuminance of a field through the pupil of pupil_diameter_mm [Td].
double retinal_illuminance_td(double luminance_cd_m2);

}  // namespace lowlux::isp
