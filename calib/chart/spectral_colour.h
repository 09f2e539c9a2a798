#pragma once

#include <array>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::calib {

/// A matrix and what it makes of the 24 ColorChecker patches, at the scale that suits their luminances best.
struct RatedMatrix {
  Matrix3 camera_to_xyz;            // the scale is that of the patches: Y = 1 for a perfect diffuser
  double condition_number = 1;      // of the equations it was made from
  std::vector<double> ciede2000;    // of each patch, in the chart's order
  std::vector<isp::Xyz> patch_xyz;  // what it makes of each
};

/// The ways from a camera's spectral sensitivities to a matrix.
struct SpectralColour {
  RatedMatrix printed;    // thesis Eq. 4.14 with Eq. 4.15 as printed: sensitivity times h c / lambda
  RatedMatrix corrected;  // the same per unit of power: times lambda / (h c)
  RatedMatrix fitted;     // least squares on isp::training_reflectances(), none of them a patch: the one for pictures
  ColourCalibration calibration;  // the fitted one as DNG has it, with its ForwardMatrix
  double training_ciede2000 = 0;  // mean over the reflectances it was fitted to
  std::array<isp::Xyz, 24> reference;
  isp::Xyz white;  // of a perfect diffuser under the light, Y = 1
};

/// @param sensitivity of R, G, B per unit radiant power, any scale
/// Errors (insufficient): those of isp::spectral_matrix and isp::fit_calibration: sensitivities that are not
/// independent, a light without luminance or that leaves a channel dark.
Result<SpectralColour> spectral_colour(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light);

}  // namespace lowlux::calib
