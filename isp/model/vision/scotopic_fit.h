#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/spectrum.h"

namespace lowlux::isp {

/// Describes how scotopic luminance follows from a camera's channels under one light.
struct ScotopicFit {
  Vector3 weights{};          // for white-balanced R, G, B, a perfect diffuser being (1, 1, 1); they sum to the ratio
  double scotopic_ratio = 0;  // exact S/P of the light
  double relative_error = 0;  // rms error of scotopic luminance over the reflectances
  double through_xyz = 0;     // relative error of scotopic_weights after the best matrix of the camera to XYZ
};

/// Fits weights of V' in a camera's channels by least squares of the relative error, with the light's own S/P for
/// white: a camera that sees more green-blue than the colour-matching functions do holds more information about the
/// rods. Luminances are relative to the photopic one of a perfect diffuser. The matrix to compare with is fitted on the
/// same reflectances, relative to luminance.
/// @param sensitivity   response per unit radiant power
/// @param light         its nodes are those of all integrals
/// @param reflectances  four at least, none black to rods
/// @return nullopt with fewer or black reflectances, a light that a channel, cones or rods do not see, or channels that
/// depend on one another over the reflectances
std::optional<ScotopicFit> fit_scotopic(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                                        std::span<const Spectrum> reflectances);

/// Returns real reflectances to fit weights on: the ten Munsell chips and the 24 patches of the older chart
/// (SpectrumSet `munsell_ten` and `macbeth`). Weights fitted on smooth synthetic reflectances are off by half as much
/// again on a ColorChecker.
const std::vector<Spectrum>& pigment_reflectances();

}  // namespace lowlux::isp
