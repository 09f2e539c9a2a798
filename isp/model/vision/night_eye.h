#pragma once

#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {

/// What an eye adapted to some field makes of colours and detail: the supported parts of the look of the night.
struct NightEye {
  MesopicState state;       // CIE 191
  double chroma = 1;        // factor on saturation, against a display of 100 cd/m2
  double blue = 0;          // how far neutrals move along the rods' tint: relative change of Rec. 709 blue
  double blur_std_deg = 0;  // Gaussian that takes what an eye in daylight sees to what this one sees
};

/// @param adaptation  [cd/m2]; figures below 0 or not numbers count as 0
NightEye night_eye(const LuminancePair& adaptation);

/// Where half of the saturation is gone, k3 of Wanat & Mantiuk.
inline constexpr double half_saturation_cd_m2 = 0.108;

/// s(L) / s(100) with s(L) = L / (L + 0.108 cd/m2), at most 1: how saturation fades (Wanat & Mantiuk, ACM TOG 33(4)
/// (2014), Eq. 26).
double chroma_share(double luminance_cd_m2);

/// The largest frequency of gratings of full contrast that is resolved [cycles per degree],
///     17.25 atan(1.4 log10 L + 0.35) + 25.72
/// (Ward Larson, Rushmeier & Piatko, IEEE TVCG 3 (1997), Eq. 7a, fitted to Shlaer 1937); not below 0.7, where the
/// figures end.
double visual_acuity_cpd(double luminance_cd_m2);

/// Standard deviation of the Gaussian that leaves a tenth of the contrast at visual_acuity_cpd(), sqrt(ln 10 / 2) /
/// (pi f), less what an eye at 100 cd/m2 has, in squares. 0 from there on.
double blur_std_deg(double luminance_cd_m2);

/// Share of a neutral's blue that rods add: the chromaticity that Kirk & O'Brien's model (as google/filament has it,
/// with light counted three times, see appearance/kirk_obrien.h) gives to a neutral of this luminance, times
/// chroma_share(): the hue of the night fades with all others.
double rod_blue(double luminance_cd_m2);

/// The direction of that shift in linear Rec. 709, for rod_blue() = 1: red, green, blue beside a luminance of 1. It is
/// the same at every luminance within 2 %; its own luminance is 0.
inline constexpr Vector3 rod_tint{-0.213, -0.037614, 1.0};

/// Stops by which a scene under this luminance looks darker than one under 100 cd/m2 to an eye adapted to each:
/// brightness is Hunt's achromatic signal of white, 3.05 f_n(F_L) + A_S, and lightness its cube root: 3 log2 of the
/// ratio, at most 0.
double apparent_dimming_ev(double luminance_cd_m2);

}  // namespace lowlux::isp
