#pragma once

#include <array>
#include <optional>

#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// Holds a CIE 1931 chromaticity.
struct Xy {
  double x = 0;
  double y = 0;
  friend bool operator==(const Xy&, const Xy&) = default;
};

/// Holds CIE 1931 tristimulus values. The unit is the caller's: relative to white (Y = 1), or cd/m2.
struct Xyz {
  double x = 0;
  double y = 0;
  double z = 0;
};

/// Holds a CIE 1976 u'v' chromaticity. (CIE 1960 uv is u = u', v = 2/3 v'.)
struct UvPrime {
  double u = 0;
  double v = 0;
};

/// Holds a CIELAB 1976 colour: L* 0..100.
struct Lab {
  double l = 0;
  double a = 0;
  double b = 0;
};

/// These white points of the 2-degree observer are rounded as in CIE 15:2018 Table T.3 and IEC 61966-2-1.
inline constexpr Xy white_d50{0.34567, 0.35850};
inline constexpr Xy white_d65{0.3127, 0.3290};
inline constexpr Xy white_e{1.0 / 3.0, 1.0 / 3.0};

constexpr Vector3 vector_of(const Xyz& c) { return {c.x, c.y, c.z}; }
constexpr Xyz xyz_of(const Vector3& v) { return {v[0], v[1], v[2]}; }

/// Returns the chromaticity; nullopt where there is none: X + Y + Z is not a positive finite number.
std::optional<Xy> xy_of(const Xyz& colour);

/// Returns the tristimulus values of chromaticity `xy` at luminance `y`; nullopt unless xy.y > 0 and all is finite.
std::optional<Xyz> xyz_of(const Xy& xy, double y = 1.0);

/// Returns u' = 4x / (-2x + 12y + 3), v' = 9y / (-2x + 12y + 3) (CIE 15:2018 section 8.2.1).
/// @return nullopt unless the denominator, which is (X + 15Y + 3Z) / (X + Y + Z), is positive and all is finite
std::optional<UvPrime> uv_prime_of(const Xy& xy);

/// Returns the inverse of uv_prime_of: x = 9u' / (6u' - 16v' + 12), y = 4v' / (6u' - 16v' + 12); nullopt likewise.
std::optional<Xy> xy_of(const UvPrime& uv);

/// Returns the linear Bradford adaptation: it takes XYZ under white `from` to the corresponding XYZ under white `to`,
///     M = B^-1 diag(B w_to / B w_from) B
/// (Lam 1985; the matrix B as in ICC.1:2010 Annex E). White goes to white at equal Y.
/// @return nullopt if a white has no XYZ or lies where a cone response of B is not positive
std::optional<Matrix3> bradford_adaptation(const Xy& from, const Xy& to);

/// Holds the chromaticities of the primaries and the white of an RGB space.
struct RgbPrimaries {
  Xy red;
  Xy green;
  Xy blue;
  Xy white;
};

inline constexpr RgbPrimaries primaries_rec709{
    {0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, white_d65};  // BT.709, sRGB
inline constexpr RgbPrimaries primaries_p3_d65{
    {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, white_d65};  // SMPTE EG 432-1
inline constexpr RgbPrimaries primaries_rec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, white_d65};  // BT.2020

/// Returns the matrix from linear RGB to XYZ with white (1, 1, 1) at Y = 1: the columns are the primaries' XYZ, scaled
/// so that they add up to the white (SMPTE RP 177). Its middle row holds the luminance weights of R, G and B.
/// @return nullopt if the primaries lie on one line or a chromaticity has no XYZ
std::optional<Matrix3> rgb_to_xyz(const RgbPrimaries& primaries);

/// Returns CIELAB of `colour` relative to `white` (CIE 15:2018 Eq. 8.3 to 8.10, exact fractions); white must be
/// positive.
Lab lab_of(const Xyz& colour, const Xyz& white);

}  // namespace lowlux::isp
