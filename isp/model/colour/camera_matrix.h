#pragma once

#include <array>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"

namespace lowlux::isp {

/// Both functions return a camera's R, G and B: for a light falling on a perfect diffuser, and for a reflectance under
/// it. They are integrals over the light's nodes, so that lines summed into bins count once.
/// @param sensitivity response per unit radiant power
Vector3 camera_response(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light);
Vector3 camera_response(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light, const Spectrum& reflectance);

/// Returns reflectances to fit matrices on, none of them a patch of a chart: the ten Munsell chips, and 200 smooth
/// ones, each the logistic function of a short cosine series spread evenly without randomness.
const std::vector<Spectrum>& training_reflectances();

enum class ForwardMatrix : bool { leave_out, fit };

/// Returns the DNG matrices of a camera for one light, by least squares on training_reflectances() with errors relative
/// to luminance. Errors: the light has no luminance or the sensitivities span fewer than three dimensions.
Result<ColourCalibration> fit_calibration(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                                          ForwardMatrix forward);

/// Holds the matrix of thesis Eq. 4.14, computed from spectra alone, and its condition number.
struct SpectralMatrix {
  Matrix3 camera_to_xyz;
  double condition_number;  // condition number of C T^t, in the 2-norm
};

/// Returns M = (T T^t) (C T^t)^-1 with T the CIE 1931 colour-matching functions and C the sensitivities, both at the
/// nodes of the first sensitivity: exact for spectra that are sums of colour-matching functions. fit_calibration is
/// better for images; this one is the thesis'.
/// @param sensitivity response per unit radiant power (Eq. 4.15 prints its reciprocal)
/// Errors: C T^t is singular, or its condition number above 1e12.
Result<SpectralMatrix> spectral_matrix(const std::array<Spectrum, 3>& sensitivity);

}  // namespace lowlux::isp
