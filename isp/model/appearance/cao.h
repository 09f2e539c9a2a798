#pragma once

#include <array>
#include <optional>

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Rods as an addition to cones (Cao, Pokorny, Smith & Zele 2008, with the luminances of Wanat & Mantiuk 2014; thesis
// Eq. 2.17, 2.18, 2.26 to 2.28).

/// What of the rods' excitation L and M cones (k1) and S cones (k2) gain.
struct CaoWeights {
  double k1 = 0;
  double k2 = 0;
};

/// 0 from 10 cd/m2, (0.0173, 0.0101) at 0.62, (0.173, 0.357) at 0.10 and below, linear in the logarithm between;
/// nothing below 0.1 was measured. @param luminance_cd_m2 > 0
CaoWeights cao_weights(double luminance_cd_m2);

/// What L, M and S cones and rods see of three primaries: rows L, M, S, rods.
using ReceptorMatrix = std::array<Vector3, 4>;

/// Smith and Pokorny's cones and a row of rods that is 1 for (1, 1, 1).
/// @param to_xyz       columns: XYZ of the primaries; identity for XYZ itself with `white` in place of (1, 1, 1)
/// @param rod_weights  of X, Y and Z in scotopic luminance; the primaries' white must not be dark to the rods
/// @param white        in the primaries
ReceptorMatrix cao_receptors(const Matrix3& to_xyz, const Vector3& rod_weights, const Vector3& white = {1, 1, 1});

/// M_c M_E: the cones' signals, rods added, of the primaries.
Matrix3 cao_signals(const CaoWeights& weights, const ReceptorMatrix& receptors);

/// (M_c(to) M_E)^-1 M_c(from) M_E: primaries seen at `from` to those that look so at `to`, the ratio of luminances
/// left out. nullopt if the receptors do not tell three primaries apart.
std::optional<Matrix3> cao_retargeting(double from_cd_m2, double to_cd_m2, const ReceptorMatrix& receptors);

/// The model as a map: from the luminance of adaptation to 10 cd/m2, where rods no longer add. One 3x3 matrix.
AppearanceModel cao_appearance();

}  // namespace lowlux::isp
