#pragma once

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

// Colour mathematics of the DNG specification 1.4, chapter 6 "Mapping Camera Color Space to CIE XYZ Space".
// All functions fail with
//   insufficient  the source holds no calibration
//   malformed     a matrix or figure is not finite, a matrix is singular, or they lead to an impossible colour.

/// Holds a scene white, given by a camera's neutral or a colour temperature.
struct WhitePoint {
  Xy xy;
  double cct_k = 0;
  double duv = 0;  // distance from the Planckian locus in CIE 1960 uv, positive on the green side
};

/// Returns AnalogBalance * CameraCalibration * ColorMatrix for a scene white: XYZ under that white -> camera RGB.
/// Between two calibrations each matrix is linear in 1/CCT, beyond them constant. If the two have the same temperature
/// or the source does not state one of them, interpolation is not possible: the last with a stated temperature is used,
/// or the last.
Result<Matrix3> xyz_to_camera(const CameraColour& colour, const Xy& scene_white);

/// Returns the weight of the calibration with the higher temperature at a scene white: linear in 1/CCT, constant beyond
/// the ends; 1 where interpolation is not possible. Precondition: a calibration.
double calibration_weight(const CameraColour& colour, const Xy& scene_white);

/// Returns the scene white that makes camera RGB `neutral` a neutral. The matrix depends on the white and the white on
/// the matrix: the iteration of the specification starts at D50; where it does not converge (a cycle between steep
/// calibrations), the interpolation weight is bisected instead. The white that a weight leads to has a weight in 0..1
/// again and moves continuously with it, so a fixed point exists whenever the matrices between the calibrations are
/// regular, and bisection finds one.
/// @param neutral  each component positive; its scale does not matter
Result<WhitePoint> white_of_neutral(const CameraColour& colour, const Vector3& neutral);

/// Returns the camera RGB of a perfect diffuser under a scene white, largest component 1: the inverse of
/// white_of_neutral.
Result<Vector3> neutral_of_white(const CameraColour& colour, const Xy& scene_white);

/// Returns the matrix from camera RGB (not white balanced) to XYZ under `output_white`. The neutral of neutral_of_white
/// goes to the output white at Y = 1: the brightest neutral that saturates no channel.
///     with ForwardMatrix F:  Bradford(D50 -> output) F diag(1 / (A n)) A,  A = (AnalogBalance CameraCalibration)^-1
///     without:               Bradford(scene -> output) (AnalogBalance CameraCalibration ColorMatrix)^-1, scaled
/// The rows of F are scaled to take (1, 1, 1) to D50 exactly, which a file's rounded figures do approximately.
/// Where only one calibration has a ForwardMatrix, it is used for both. A calibration that is alone, with a stated
/// temperature and no ForwardMatrix, has the one that its ColorMatrix CM implies at the white w of that temperature,
///     F = Bradford(w -> D50) CM^-1 diag(CM w)
/// so that lights far from w are white balanced on camera RGB, as LibRaw and RawTherapee do. In artificial light this
/// is closer to the true colours of surfaces than the inverse of CM is: ColourChecker.* of scenarios_test print both
/// errors.
Result<Matrix3> camera_to_xyz(const CameraColour& colour, const Xy& scene_white, const Xy& output_white);

}  // namespace lowlux::isp
