#pragma once

#include <optional>

#include "isp/base/matrix3.h"
#include "isp/model/colour/chromaticity_cloud.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Returns the Fisher information that one pixel y = Poisson(lambda) + Normal(0, sigma^2) holds on lambda [e-^-2]:
///     J = integral of (dp/dlambda)^2 / p dy,  dPois(j)/dlambda = Pois(j - 1) - Pois(j)
/// by the trapezium rule below lambda + sigma^2 = 1000 e-^2, and by its asymptotic form from there on:
///     J = 1 / V + (m / V)^2 / (2 V^2 + lambda m / V),  V = lambda + m,
/// with m the variance with which an integer number of electrons, all equally probable, is known from y: sigma^2 from 1
/// e- up and less below. Relative error below 1e-6 for lambda from 1e-9 to 1e6 and sigma from 0.05 to 100; where sigma
/// is below 0.05 e- electrons are counted, J = 1 / lambda.
/// @param poisson_mean_e  lambda, signal and dark charge [e-], >= 0; 0 has the limit exp(1 / sigma^2) - 1
/// @param noise_std_e     sigma, >= 0
/// @return at most 1 / lambda; infinite if both are 0, or beyond double
double fisher_information_e2(double poisson_mean_e, double noise_std_e);

/// Describes an evenly lit patch of a sensor. Arrays of three are for R, G and B.
struct FlatPatch {
  Vector3 signal_e{};                  // mean, >= 0
  Vector3 dark_e{};                    // mean, >= 0
  double noise_std_e = 0;              // read noise and quantisation, > 0 where there is no charge
  Vector3 pixels{1, 1, 1};             // N, > 0; a Bayer mosaic of n cells has {n, 2 n, n}
  std::optional<Vector3> dark_pixels;  // M, > 0: pixels the dark is measured on; absent: it is known exactly
};

/// Holds the covariance of chromaticities u' and v'.
struct UvCovariance {
  double uu = 0;
  double uv = 0;
  double vv = 0;
};

/// Holds the precision of a patch's chromaticity.
struct ChromaPrecision {
  UvPrime uv;
  UvCovariance uv_covariance;
  Xy xy;
  XyCovariance xy_covariance;
  double weight_snr = 0;  // W / std(W), W = X + 15 Y + 3 Z: below about 5 the chromaticity has heavy tails
};

/// Both functions return the root of the summed variances.
double rss_std(const UvCovariance& covariance);
double rss_std(const XyCovariance& covariance);

/// Returns the Cramer-Rao bound of a patch's chromaticity, dark subtracted: no unbiased estimator has less variance.
///     C = J A Sigma A^T J^T,  Sigma = diag(1 / (N_k J(s_k + d_k, sigma)) [+ 1 / (M_k J(d_k, sigma))]),
/// with J the derivative of u'v' (or xy) by XYZ. It falls as 1 / N.
/// @param camera_to_xyz  A, of electrons; its scale does not matter
/// @return nullopt if the signal has no chromaticity
std::optional<ChromaPrecision> chroma_crb(const Matrix3& camera_to_xyz, const FlatPatch& patch);

/// Returns the precision, to first order, of the chromaticity of the mean pixel: variances (s_k + d_k + sigma^2) / N_k
/// in place of those of chroma_crb. It is the scatter of an averaged patch.
std::optional<ChromaPrecision> chroma_of_means(const Matrix3& camera_to_xyz, const FlatPatch& patch);

}  // namespace lowlux::isp
