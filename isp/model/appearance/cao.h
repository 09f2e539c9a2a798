#pragma once

#include <array>
#include <optional>

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Rod contribution added to cone signals (Cao, Pokorny, Smith & Zele 2008, with the luminances of Wanat & Mantiuk 2014;
// thesis Eq. 2.17, 2.18, 2.26 to 2.28).

/// Holds the weights of the rods' excitation in L and M cones (k1) and in S cones (k2).
struct CaoWeights {
  double k1 = 0;
  double k2 = 0;
};

/// Returns the weights: 0 from 10 cd/m2, (0.0173, 0.0101) at 0.62, (0.173, 0.357) at 0.10 and below, linear in the
/// logarithm between; nothing below 0.1 was measured. @param luminance_cd_m2 > 0
CaoWeights cao_weights(double luminance_cd_m2);

/// Holds the responses of L, M and S cones and rods to three primaries: rows L, M, S, rods.
using ReceptorMatrix = std::array<Vector3, 4>;

/// Returns Smith and Pokorny's cones and a row of rods that is 1 for (1, 1, 1).
/// @param to_xyz       columns: XYZ of the primaries; identity for XYZ itself with `white` in place of (1, 1, 1)
/// @param rod_weights  weights of X, Y and Z in scotopic luminance; the primaries' white must not be dark to the rods
/// @param white        in the primaries
ReceptorMatrix cao_receptors(const Matrix3& to_xyz, const Vector3& rod_weights, const Vector3& white = {1, 1, 1});

/// Returns M_c M_E: the cone signals of the primaries, with the rods added.
Matrix3 cao_signals(const CaoWeights& weights, const ReceptorMatrix& receptors);

/// Returns (M_c(to) M_E)^-1 M_c(from) M_E: it maps primaries seen at `from` to those that look the same at `to`,
/// without the ratio of luminances; nullopt if the receptors do not distinguish three primaries.
std::optional<Matrix3> cao_retargeting(double from_cd_m2, double to_cd_m2, const ReceptorMatrix& receptors);

/// Returns the model as a map: from the luminance of adaptation to 10 cd/m2, where rods no longer contribute. One 3x3
/// matrix.
AppearanceModel cao_appearance();

}  // namespace lowlux::isp
