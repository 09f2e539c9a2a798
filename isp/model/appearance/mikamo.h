#pragma once

#include <array>

#include "isp/base/matrix3.h"
#include "isp/base/spectrum.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

// Opponent colours of an eye adapted to a retinal illuminance, as weights of shifted cone fundamentals (Mikamo, Slomp,
// Raytchev, Tamaki & Kaneda 2014, from a public implementation; the paper was not available).

inline constexpr double mikamo_reference_td = 150;  // level at which it was matched against daylight

/// Holds the shifts of the L, M, S fundamentals and the weights of the shifted ones.
struct MikamoCoefficients {
  Vector3 shift_nm{};
  Vector3 red_green{};    // k1, k2, k3
  Vector3 blue_yellow{};  // k4, k5, k6
};

/// Returns the closed forms of the retinal illuminance I [Td]; values below 1e-4 Td count as 1e-4 Td.
MikamoCoefficients mikamo_coefficients(double illuminance_td);

/// Returns V = 0.6 l' + 0.4 m', r/g and y/b of three basis lights: a row each. The fundamental is read at the
/// wavelength plus its shift, l'(nm) = l(nm + shift), so that the peak of V goes from red to green with falling light.
/// @param basis  spectral radiances
Matrix3 mikamo_signals(const MikamoCoefficients& coefficients, const std::array<Spectrum, 3>& basis);

/// Returns the signals for an eye adapted to the sum of the three lights, which then excites V alone: the part of r/g
/// and y/b proportional to V that this white would have is subtracted. This step is not in the source; without it a
/// daylight white turns deep blue in the dark, for its own r/g fades too.
Matrix3 mikamo_adapted(const Matrix3& signals);

/// Returns the model as a map: M(150 Td)^-1 M(I), both adapted to the white, over the smoothest spectra of Rec.709's
/// primaries (see lift()), with the pupil of the adaptation; from 150 Td up the identity. One 3x3 matrix.
AppearanceModel mikamo_appearance();

}  // namespace lowlux::isp
