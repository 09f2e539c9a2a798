#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Rods that speak through the cones' opponent channels (Kirk & O'Brien 2011; thesis Eq. 2.22 to 2.25 with the power
// 1/2). Written with the gains g of cones that rods desensitise too.

/// What the receptors see, in trolands for the paper's variant.
struct ReceptorSignals {
  Vector3 cones{};  // L, M, S
  double rods = 0;
};

/// What the rods add to the opponent signals, before x, y, z are solved for cones.
struct OpponentGain {
  Vector3 gain{};      // g_L, g_M, g_S
  Vector3 opponent{};  // change of M - L, of S - L - M, of L + M
};

/// g = (1 + 0.33 (q + k q_rod))^(-1/2), k = 0.25 for L and M, 0.4 for S, and the changes
///     M - L:      15 k_1 (1.111 g_M / mmax - 0.939 g_L / lmax) q_rod
///     S - L - M:  15 (0.4 g_S / smax - 0.15 W) q_rod
///     L + M:      5 W q_rod,   W = 0.619 g_L / lmax + 0.381 g_M / mmax
/// with lmax, mmax, smax = 0.637, 0.392, 1.606. Where cones are so negative that 1 + 0.33 (...) is below 1e-6, it is
/// that.
OpponentGain kirk_opponent_gain(const ReceptorSignals& seen);

/// The same as google/filament's ColorGrading has it: g = (1 + max(0, 0.33 / m_i (q_i + k_i q_rod)))^(-1/2) with
/// k = (0.2, 0.2, 0.3), and the rods' part in L and M of S - L - M added, not subtracted.
OpponentGain filament_opponent_gain(const ReceptorSignals& seen);

/// Cones that see what the change of opponent signals makes of them: dL = (dlum - dRG) / 2, dM = (dlum + dRG) / 2,
/// dS = dBY + dlum.
Vector3 kirk_cone_change(const OpponentGain& change);

/// Linear Rec.709 as Filament's night adaptation shows it: receptors of 380 rgb, the cones' change, and back.
Vector3 filament_night(const Vector3& rec709);

/// The paper's variant as a map: Smith and Pokorny's cones, each as many trolands as the white's through the pupil of
/// the adaptation; rods likewise. Of the model's answer the chromaticity, luminance from L_mes.
AppearanceModel kirk_obrien_appearance();
/// Filament's variant as a map, fed with three times the cd/m2 (that factor is known to within 1.1 and 8.3 alone);
/// chromaticity and luminance likewise.
AppearanceModel filament_appearance();

}  // namespace lowlux::isp
