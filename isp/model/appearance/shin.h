#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/shin_table.h"

namespace lowlux::isp {

// The two-stage model of mesopic colour of Shin, Matsuki, Yaguchi & Shioiri, Optical Review 11 (2004) 272-278 (thesis
// Eq. 5.10 to 5.14). Cones are Smith and Pokorny's, L + M = Y; rods are computed by scotopic_weights.

/// Selects the matrix from opponent signals to XYZ: the inverse of the forward matrix, or the published one, rounded,
/// by which X of a white comes back 0.3 % low.
enum class ShinMatrix : std::uint8_t { exact, published };

/// Selects whether cones are scaled so that the white is (2/3, 1/3, 1), where both chromatic signals vanish, and scaled
/// back afterwards. The equations themselves assume the equal-energy white.
enum class ShinAdaptation : std::uint8_t { to_white, none };

/// Holds the state of adaptation of Shin's model.
struct ShinObserver {
  Xyz white{0.95047, 1.0, 1.08883};  // the scene's white, Y = Y_w > 0; must excite all cones and rods
  double rod_white = 0.784;          // K'_w / K_w, with K_w = Y_w
  double gamma = 0.77;               // power of the rods in the achromatic signal
  ShinMatrix matrix = ShinMatrix::exact;
  ShinAdaptation adaptation = ShinAdaptation::to_white;
};

/// Holds the linear parts of the model for one observer, computed once.
struct ShinEye {
  Matrix3 to_opponent;    // XYZ to L + M, L - 2 M, L + M - S
  Matrix3 from_opponent;  // inverse of to_opponent
  double white_y;         // Y_w
  double white_scotopic;  // Y'_w
  double rod_white;
  double gamma;
};
ShinEye shin_eye(const ShinObserver& observer);

/// Holds the signals of the opponent channels; a is in the unit of Y.
struct OpponentSignals {
  double a = 0;
  double rg = 0;
  double by = 0;
};

/// Returns E of a scene from the luminance of its white: pi Y / 0.9 lx, or the figure in cd/m2 itself.
double shin_level(double white_cd_m2, ShinUnits units);

/// Returns the opponent signals of a colour:
///     a  = alpha K_w (L + M) / (L_w + M_w) + beta K'_w (Y' / Y'_w)^gamma
///     rg = l (L - 2 M) + a Y',   by = m (L + M - S) + b Y'
/// Y' below 0 counts as 0.
OpponentSignals shin_forward(const Xyz& colour, const ShinCoefficients& c, const ShinEye& eye);

/// Returns the colour that gives these signals in daylight.
Xyz shin_daylight(const OpponentSignals& signals, const ShinEye& eye);

/// Holds a colour for an eye at another level, and whether it gives the requested signals.
struct ShinInverse {
  Xyz colour;
  bool exact = true;  // false: alpha, l or m was below 0.05, L + M would be negative, or no rod signal fits
};

/// Returns the colour that gives these signals at coefficients c: the equations solved for L, M and S with Y' that of
/// the colour itself, a scalar equation (regula falsi). alpha, l and m are at least 0.05 in it, L + M at least 0. Its
/// components may be negative: apply a gamut map afterwards.
ShinInverse shin_inverse(const OpponentSignals& signals, const ShinCoefficients& c, const ShinEye& eye);

/// Returns the published form, with Y' of the source's colour [relative as Y] in place of the result's own: the result
/// then does not give the requested signals, unless the level is the same.
ShinInverse shin_inverse_published(const OpponentSignals& signals, const ShinCoefficients& c, const ShinEye& eye,
                                   double source_scotopic);

/// Returns the model as a map: signals at the scene's level, seen in daylight.
AppearanceModel shin_appearance();

}  // namespace lowlux::isp
