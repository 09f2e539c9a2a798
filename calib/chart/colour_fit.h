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

/// A patch of a chart as a camera and as the standard observer see it.
struct ColourSample {
  Vector3 camera_rgb{};  // not white balanced, any scale that all samples share
  isp::Xyz reference;    // under the chart's light, Y = 1 for a perfect diffuser
  double x = 0;          // place on the chart, -1 at its left edge to 1 at its right
  double y = 0;          // -1 at its upper edge to 1 at its lower
};

/// Light that falls off evenly over a chart: 1 + x per_x + y per_y, relative to that at the chart's middle.
struct LightGradient {
  double per_x = 0;
  double per_y = 0;
  double at(double x, double y) const { return 1 + x * per_x + y * per_y; }
};

struct ColourFitOptions {
  isp::Xyz white;                  // of a perfect diffuser under the chart's light, Y = 1: CIELAB is relative to it
  bool uneven_light = true;        // fit a LightGradient too
  bool minimise_ciede2000 = true;  // from the least-squares matrix on; else that one stays
  /// Camera RGB that the matrix takes to a multiple of `white` exactly; all 0: none.
  Vector3 neutral{};
};

/// A matrix fitted to a chart.
struct ColourFit {
  Matrix3 camera_to_xyz;        // to XYZ under the chart's light, for the light at the chart's middle
  LightGradient light;          // zero unless it was fitted
  double condition_number = 1;  // of the least-squares equations, their columns scaled to length 1
};

/// Samples a fit needs: half as many again as it has unknowns, nine of the matrix and two of the light.
inline constexpr std::size_t least_colour_samples = 17;
/// Above it the patches do not tell the columns of a matrix apart: 24 patches of a ColorChecker have 8 to 9.
inline constexpr double worst_colour_condition = 1e4;

/// The matrix M and the gradient L that bring M camera / L(x, y) nearest to the reference:
///   1. least squares, linear in both: M camera - reference (x per_x + y per_y) = reference, weighted with Y^(-2/3),
///      how CIELAB weighs small differences;
///   2. from there Levenberg's damped Gauss-Newton on the sum of squared CIEDE2000.
/// Errors (insufficient): fewer than least_colour_samples, a number that is not finite, a reference without luminance,
/// a condition number above worst_colour_condition, a matrix that cannot be inverted, light that would fall to 0.
Result<ColourFit> fit_colour(std::span<const ColourSample> samples, const ColourFitOptions& options);

/// XYZ that a fit makes of a sample, the light's gradient taken out.
isp::Xyz predicted(const ColourFit& fit, const ColourSample& sample);

/// CIEDE2000 of each sample between prediction and reference, relative to `white`.
std::vector<double> colour_errors(const ColourFit& fit, std::span<const ColourSample> samples, const isp::Xyz& white);

/// CIEDE2000 of each sample under the fit made of all others. Errors: those of
/// fit_colour, which has one sample less.
Result<std::vector<double>> cross_validated(std::span<const ColourSample> samples, const ColourFitOptions& options);

/// A given matrix (camera -> XYZ under the chart's light) with the scale, and the gradient if options ask for one, that
/// bring its Y nearest to the references': what can be said for a matrix that knows nothing of the exposure.
/// Errors (insufficient): as fit_colour, or it gives the chart no positive luminance.
Result<ColourFit> scaled_to_chart(const Matrix3& camera_to_xyz, std::span<const ColourSample> samples,
                                  const ColourFitOptions& options);

/// A fit as DNG has it. ColorMatrix: XYZ under the chart's light to camera RGB, the largest component of white's 1;
/// ForwardMatrix: white-balanced camera RGB to XYZ under D50 (Bradford), (1, 1, 1) going to D50.
/// @param white of a perfect diffuser under the chart's light, Y = 1
/// Error (insufficient): the matrix is singular, or white would leave a channel dark.
Result<ColourCalibration> calibration_of(const ColourFit& fit, const isp::Xyz& white);

struct ErrorSummary {
  double mean = 0;
  double median = 0;
  double largest = 0;
};
/// All 0 if there are none.
ErrorSummary summary_of(std::vector<double> errors);

/// XYZ of the 24 ColorChecker patches (Ohta's reflectances, isp/model/data/SOURCES.md) under a light, Y = 1 for a
/// perfect diffuser, in the chart's order. Error (insufficient): the light has no luminance.
Result<std::array<isp::Xyz, 24>> chart_reference(const Spectrum& light);

}  // namespace lowlux::calib
