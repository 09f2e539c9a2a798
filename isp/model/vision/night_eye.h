#pragma once

#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {

/// Describes how an eye adapted to a field perceives colours and detail: the supported effects of night vision.
struct NightEye {
  MesopicState state;       // CIE 191
  double chroma = 1;        // factor on saturation, against a display of 100 cd/m2
  double blue = 0;          // shift of neutrals along the rods' tint: relative change of Rec. 709 blue
  double blur_std_deg = 0;  // Gaussian that converts daylight acuity to this eye's acuity
};

/// Returns the eye adapted to a field.
/// @param adaptation  [cd/m2]; figures below 0 or not numbers count as 0
NightEye night_eye(const LuminancePair& adaptation);

/// Gives the luminance at which half of the saturation is lost, k3 of Wanat & Mantiuk.
inline constexpr double half_saturation_cd_m2 = 0.108;

/// Returns s(L) / s(100) with s(L) = L / (L + 0.108 cd/m2), at most 1: the loss of saturation (Wanat & Mantiuk, ACM TOG
/// 33(4) (2014), Eq. 26).
double chroma_fraction(double luminance_cd_m2);

/// Returns the largest frequency of gratings of full contrast that is resolved [cycles per degree],
///     17.25 atan(1.4 log10 L + 0.35) + 25.72
/// (Ward Larson, Rushmeier & Piatko, IEEE TVCG 3 (1997), Eq. 7a, fitted to Shlaer 1937); at least 0.7, where the data
/// end.
double visual_acuity_cpd(double luminance_cd_m2);

/// Returns the standard deviation of the Gaussian that leaves a tenth of the contrast at visual_acuity_cpd(), sqrt(ln
/// 10 / 2) / (pi f), minus that of an eye at 100 cd/m2, in squares. 0 from 100 cd/m2 on.
double blur_std_deg(double luminance_cd_m2);

/// Returns the fraction of a neutral's blue that rods add: the chromaticity that Kirk & O'Brien's model (as in
/// google/filament, with light counted three times, see appearance/kirk_obrien.h) gives to a neutral of this luminance,
/// times chroma_fraction(): the hue of the night fades with all others.
double rod_blue(double luminance_cd_m2);

/// Gives the direction of the shift of rod_blue() in linear Rec. 709, for rod_blue() = 1: red, green, blue relative to
/// a luminance of 1. It is the same at every luminance within 2 %; its own luminance is 0.
inline constexpr Vector3 rod_tint{-0.213, -0.037614, 1.0};

/// Returns the stops by which a scene of this luminance looks darker than one of 100 cd/m2 to an eye adapted to each:
/// brightness is Hunt's achromatic signal of white, 3.05 f_n(F_L) + A_S, and lightness its cube root: 3 log2 of the
/// ratio, at most 0.
double apparent_dimming_ev(double luminance_cd_m2);

}  // namespace lowlux::isp
