#pragma once

#include <array>

#include "isp/base/matrix3.h"
#include "isp/base/spectrum.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Opponent colours of an eye adapted to a retinal illuminance, as weights of shifted cone fundamentals (Mikamo,
// Slomp, Raytchev, Tamaki & Kaneda 2014, by way of a public implementation; the paper was not seen).

inline constexpr double mikamo_reference_td = 150;  // where it was matched against daylight

/// Shifts of the L, M, S fundamentals and weights of the shifted ones.
struct MikamoCoefficients {
  Vector3 shift_nm{};
  Vector3 red_green{};    // k1, k2, k3
  Vector3 blue_yellow{};  // k4, k5, k6
};

/// The closed forms of the retinal illuminance I [Td]; below 1e-4 Td it counts as that.
MikamoCoefficients mikamo_coefficients(double illuminance_td);

/// What V = 0.6 l' + 0.4 m', r/g and y/b make of three basis lights: a row each. The fundamental is read at the
/// wavelength plus its shift, l'(nm) = l(nm + shift), so that the peak of V goes from red to green with falling light.
/// @param basis  spectral radiances
Matrix3 mikamo_signals(const MikamoCoefficients& coefficients, const std::array<Spectrum, 3>& basis);

/// The same for an eye adapted to the sum of the three lights, which then excites V alone: of r/g and y/b as much of V
/// is taken off as that white would have. Not in the source; without it a daylight white turns deep blue in the dark,
/// for its own r/g fades too.
Matrix3 mikamo_adapted(const Matrix3& signals);

/// The model as a map: M(150 Td)^-1 M(I), both adapted to the white, over the smoothest spectra of Rec.709's primaries
/// (see lift()), the pupil being that of the adaptation; from 150 Td up the identity. One 3x3 matrix.
AppearanceModel mikamo_appearance();

}  // namespace lowlux::isp
