#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "isp/base/matrix3.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/sensor/photon.h"

namespace lowlux::isp {

/// Holds the covariance of chromaticities x and y.
struct XyCovariance {
  double xx = 0;
  double xy = 0;
  double yy = 0;
};

/// Describes the chromaticities of one colour measured many times, or their prediction.
struct ChromaticityCloud {
  Xy mean;
  XyCovariance covariance;
};

/// Returns the mean and covariance (divided by n - 1) of a cloud; nullopt for fewer than two samples or one that is not
/// finite.
std::optional<ChromaticityCloud> cloud_of(std::span<const Xy> samples);

/// Describes an ellipse in the chromaticity plane.
struct XyEllipse {
  Xy centre;
  double semi_major = 0;
  double semi_minor = 0;
  double inclination_deg = 0;  // angle of the major axis to the x axis, anticlockwise, [0, 180); 0 for a circle
};

/// Returns the size of an ellipse: sqrt(a^2 + b^2) (thesis section 4.5.2).
double size_of(const XyEllipse& ellipse);

/// Returns the ellipse of a cloud by its principal axes: the semi-axes are `deviations` standard deviations along them.
/// The thesis draws 10.
XyEllipse principal_ellipse(const ChromaticityCloud& cloud, double deviations);

/// Returns the smallest difference of two inclinations [degrees], -90..90: an axis has no direction.
double inclination_difference_deg(double first_deg, double second_deg);

/// Returns the ellipse of least area around all samples: Khachiyan's algorithm with away steps (Todd & Yildirim,
/// Discrete Appl. Math. 155 (2007) 1731-1744), scaled at the end so that no sample lies outside. Its area is within
/// 1e-6 of the least.
/// @return nullopt for fewer than three samples, one that is not finite, or samples that are all on one line
std::optional<XyEllipse> enclosing_ellipse(std::span<const Xy> samples);

/// Returns the covariance of the chromaticity of tristimulus values, to first order: J C J^T, J = d(x, y) / d(X, Y, Z)
/// at the mean.
/// @return nullopt if the mean has no chromaticity
std::optional<ChromaticityCloud> propagated_cloud(const Xyz& mean, const Matrix3& covariance);

/// Returns the cloud of an ideal observer who counts photons, to first order (thesis section 3.4): with v_i the
/// colour-matching functions at lambda_i, mean sum of x_i (h c / lambda_i) v_i, covariance sum of x_i (h c /
/// lambda_i)^2 v_i v_i^T. It scales with 1 / photons, so that its inclination is the same at all light levels. Ideal
/// cones give the same cloud, being linear combinations of the colour-matching functions.
/// @return nullopt if no photon reaches a wavelength the observer sees
std::optional<ChromaticityCloud> predicted_cloud(const PhotonMeans& means);

/// Returns the XYZ of counted photons: sum of X_i (h c / lambda_i) v_i, in units of 1e-19 J.
/// @param counts  counts of the bins of `means`, as many
Xyz xyz_of_photons(const PhotonMeans& means, std::span<const double> counts);

}  // namespace lowlux::isp
