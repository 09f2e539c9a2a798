#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Rod signals in the cones' opponent channels (Kirk & O'Brien 2011; thesis Eq. 2.22 to 2.25 with the power 1/2),
// written with the gains g of cones that rods desensitise too.

/// Holds receptor responses, in trolands for the paper's variant.
struct ReceptorSignals {
  Vector3 cones{};  // L, M, S
  double rods = 0;
};

/// Holds the rods' contribution to the opponent signals, before x, y, z are solved for cones.
struct OpponentGain {
  Vector3 gain{};      // g_L, g_M, g_S
  Vector3 opponent{};  // change of M - L, of S - L - M, of L + M
};

/// Returns g = (1 + 0.33 (q + k q_rod))^(-1/2), k = 0.25 for L and M, 0.4 for S, and the changes
///     M - L:      15 k_1 (1.111 g_M / mmax - 0.939 g_L / lmax) q_rod
///     S - L - M:  15 (0.4 g_S / smax - 0.15 W) q_rod
///     L + M:      5 W q_rod,   W = 0.619 g_L / lmax + 0.381 g_M / mmax
/// with lmax, mmax, smax = 0.637, 0.392, 1.606. 1 + 0.33 (...) is at least 1e-6, also for strongly negative cones.
OpponentGain kirk_opponent_gain(const ReceptorSignals& seen);

/// Returns gains and changes as in google/filament's ColorGrading: g = (1 + max(0, 0.33 / m_i (q_i + k_i
/// q_rod)))^(-1/2) with k = (0.2, 0.2, 0.3), and the rods' part in L and M of S - L - M added, not subtracted.
OpponentGain filament_opponent_gain(const ReceptorSignals& seen);

/// Returns the change of the cones that corresponds to a change of opponent signals: dL = (dlum - dRG) / 2, dM = (dlum
/// + dRG) / 2, dS = dBY + dlum.
Vector3 kirk_cone_change(const OpponentGain& change);

/// Returns linear Rec.709 after Filament's night adaptation: receptors of 380 rgb, the cones' change, and back.
Vector3 filament_night(const Vector3& rec709);

/// Returns the paper's variant as a map: Smith and Pokorny's cones, each as many trolands as the white's through the
/// pupil of the adaptation; rods likewise. Only the chromaticity of the model's result is used; luminance is from
/// L_mes.
AppearanceModel kirk_obrien_appearance();
/// Returns Filament's variant as a map, for three times the cd/m2 (that factor is only known to within 1.1 and 8.3);
/// chromaticity and luminance as in kirk_obrien_appearance.
AppearanceModel filament_appearance();

}  // namespace lowlux::isp
