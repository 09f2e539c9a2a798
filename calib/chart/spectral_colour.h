#pragma once

#include <array>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::calib {

/// A matrix and its results for the 24 ColorChecker patches, at the scale that fits their luminances best.
struct RatedMatrix {
  Matrix3 camera_to_xyz;            // the scale is that of the patches: Y = 1 for a perfect diffuser
  double condition_number = 1;      // condition number of the equations it was computed from
  std::vector<double> ciede2000;    // CIEDE2000 of each patch, in the chart's order
  std::vector<isp::Xyz> patch_xyz;  // its result for each patch
};

/// Matrices computed from a camera's spectral sensitivities in several ways.
struct SpectralColour {
  RatedMatrix printed;    // thesis Eq. 4.14 with Eq. 4.15 as printed: sensitivity times h c / lambda
  RatedMatrix corrected;  // `printed` per unit of power: times lambda / (h c)
  RatedMatrix fitted;     // least squares on isp::training_reflectances(), none of them a patch: the one for images
  ColourCalibration calibration;  // the fitted one in the form of DNG, with its ForwardMatrix
  double training_ciede2000 = 0;  // mean over the reflectances of the fit
  std::array<isp::Xyz, 24> reference;
  isp::Xyz white;  // colour of a perfect diffuser under the light, Y = 1
};

/// Computes the matrices and their errors.
/// @param sensitivity sensitivity of R, G, B per unit radiant power, any scale
/// Errors (insufficient): those of isp::spectral_matrix and isp::fit_calibration: sensitivities that are not
/// independent, a light that has no luminance or leaves a channel dark.
Result<SpectralColour> spectral_colour(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light);

}  // namespace lowlux::calib
