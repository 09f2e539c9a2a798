#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// The tone compression of iCAM06 (Kuang, Johnson & Fairchild 2007; thesis Eq. 2.19 to 2.21 with a separate channel in
// each row and the fourth power of (1 - j^2)).

/// Lists the paper and the authors' program, which differ.
enum class Icam06Variant : std::uint8_t {
  paper,
  icam06_matlab_compat,  // like the authors' program: s^3 for s^0.3 in B_S, + 0.03 for + 0.3 in A_s, S_w = 5 L_A
};

/// Holds the state of adaptation of iCAM06.
struct Icam06State {
  double white_cd_m2 = 0;           // Y_w > 0; L_A is a fifth of it
  double scotopic_white_cd_m2 = 0;  // S_w > 0
  double power = 0.7;               // p, 0.6 to 0.85
  Icam06Variant variant = Icam06Variant::paper;
};

/// Holds the result of the compression: RGB'_a of the cones, A_s of the rods, and their sum in XYZ, a response without
/// unit.
struct Icam06Response {
  Vector3 cones{};
  double rods = 0;
  Vector3 xyz_tc{};
};

/// Compresses a colour.
/// @param xyz_cd_m2  adapted to the white; its |Y| is the rods' input
Icam06Response icam06_compress(const Vector3& xyz_cd_m2, const Icam06State& state);

/// Returns the XYZ [cd/m2] of a luminance of at least 0 that compresses to xyz_tc: the rods' part is that of the
/// result, a scalar equation. Responses below those of black get black's rods; cone responses of 400, which no light
/// gives, count as a millionth less. Valid for the paper's variant only: the rods of the program's variant dim again
/// with light, so that several luminances give one response.
Vector3 icam06_expand(const Vector3& xyz_tc, const Icam06State& state);

/// Returns the model as a map: cones fully adapted to the white in HPE space, compressed with Y_w = S_w of the scene's
/// white, expanded with those of a white of 318.31 cd/m2 (1000 lx); from there up the identity.
AppearanceModel icam06_appearance();

}  // namespace lowlux::isp
