#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::calib {

/// Colour of a chart patch as measured by a camera and for the standard observer.
struct ColourSample {
  Vector3 camera_rgb{};  // not white balanced, any scale common to all samples
  isp::Xyz reference;    // under the chart's light, Y = 1 for a perfect diffuser
  double x = 0;          // position on the chart, -1 at its left edge to 1 at its right
  double y = 0;          // -1 at its upper edge to 1 at its lower
};

/// Light that varies linearly over a chart: 1 + x per_x + y per_y, relative to that at the chart's middle.
struct LightGradient {
  double per_x = 0;
  double per_y = 0;
  double at(double x, double y) const { return 1 + x * per_x + y * per_y; }
};

/// Holds the options of fit_colour().
struct ColourFitOptions {
  isp::Xyz white;                  // of a perfect diffuser under the chart's light, Y = 1: CIELAB is relative to it
  bool uneven_light = true;        // fit a LightGradient as well
  bool minimise_ciede2000 = true;  // starting from the least-squares matrix; else return that one
  /// Camera RGB that the matrix maps to a multiple of `white` exactly; all 0: none.
  Vector3 neutral{};
};

/// A matrix fitted to a chart.
struct ColourFit {
  Matrix3 camera_to_xyz;        // to XYZ under the chart's light, for the light at the chart's middle
  LightGradient light;          // zero unless it was fitted
  double condition_number = 1;  // condition number of the least-squares equations, their columns scaled to length 1
};

/// Minimum number of samples for a fit: one and a half times the unknowns, nine of the matrix and two of the light.
inline constexpr std::size_t min_colour_samples = 17;
/// Above this condition number the patches do not determine the columns of a matrix: 24 patches of a ColorChecker have
/// 8 to 9.
inline constexpr double worst_colour_condition = 1e4;

/// Fits the matrix M and the gradient L that bring M camera / L(x, y) nearest to the reference:
///   1. least squares, linear in both: M camera - reference (x per_x + y per_y) = reference, weighted with Y^(-2/3),
///      how CIELAB weighs small differences;
///   2. from there Levenberg's damped Gauss-Newton on the sum of squared CIEDE2000.
/// Errors (insufficient): fewer than min_colour_samples, a number that is not finite, a reference without luminance,
/// a condition number above worst_colour_condition, a matrix that cannot be inverted, light that would fall to 0.
Result<ColourFit> fit_colour(std::span<const ColourSample> samples, const ColourFitOptions& options);

/// Returns the XYZ predicted by a fit for a sample, corrected for the light's gradient.
isp::Xyz predicted(const ColourFit& fit, const ColourSample& sample);

/// Returns the CIEDE2000 of each sample between prediction and reference, relative to `white`.
std::vector<double> colour_errors(const ColourFit& fit, std::span<const ColourSample> samples, const isp::Xyz& white);

/// Returns the CIEDE2000 of each sample with a fit made of all others. Errors: those of fit_colour, which has one
/// sample less.
Result<std::vector<double>> cross_validated(std::span<const ColourSample> samples, const ColourFitOptions& options);

/// Scales a given matrix (camera -> XYZ under the chart's light), and fits the gradient if options ask for one, to
/// bring its Y nearest to the references': this rates a matrix of unknown exposure. Errors (insufficient): as
/// fit_colour, or the matrix gives the chart no positive luminance.
Result<ColourFit> scaled_to_chart(const Matrix3& camera_to_xyz, std::span<const ColourSample> samples,
                                  const ColourFitOptions& options);

/// Converts a fit to the form of DNG. ColorMatrix: XYZ under the chart's light to camera RGB, the largest component of
/// white's 1; ForwardMatrix: white-balanced camera RGB to XYZ under D50 (Bradford), mapping (1, 1, 1) to D50.
/// @param white colour of a perfect diffuser under the chart's light, Y = 1
/// Error (insufficient): the matrix is singular, or white would leave a channel dark.
Result<ColourCalibration> calibration_of(const ColourFit& fit, const isp::Xyz& white);

/// Summarises colour errors over patches [CIEDE2000].
struct ErrorSummary {
  double mean = 0;
  double median = 0;
  double largest = 0;
};
/// Returns a summary of errors; all 0 if there are none.
ErrorSummary summary_of(std::vector<double> errors);

/// Returns the XYZ of the 24 ColorChecker patches (Ohta's reflectances, isp/model/data/SOURCES.md) under a light, Y = 1
/// for a perfect diffuser, in the chart's order. Error (insufficient): the light has no luminance.
Result<std::array<isp::Xyz, 24>> chart_reference(const Spectrum& light);

}  // namespace lowlux::calib
