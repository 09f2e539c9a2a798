#pragma once

#include <span>

#include "isp/model/chromaticity_cloud.h"

namespace lowlux::isp {

/// How many standard errors a sampled figure may be off before it counts as different.
inline constexpr double confidence_errors = 5;

/// A figure with its standard error.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// Mean of at least two samples.
Estimate mean_of(std::span<const double> samples);

/// Exponent of the power law y ~ x^exponent, by weighted least squares of log y over log x.
/// @param x      positive, not all equal
/// @param log_y  natural logarithms with their standard errors (> 0), as many
Estimate power_law_exponent(std::span<const double> x, std::span<const Estimate> log_y);

/// Natural logarithm of the size (thesis 3.3) of a cloud's ellipse, as sampled by a normal cloud of n points:
/// size^2 is the trace t of C, and Var(t) = 2 trace(C^2) / (n - 1).
Estimate log_size_of(const XyCovariance& covariance, std::size_t n);

/// How far the orientation of a sampled covariance is from an inclination, in standard errors of a normal cloud of n
/// points with the expected covariance and that inclination: the sampled covariance of the two principal axes, which is
/// 0 in the mean and has Var = l1 l2 / (n - 1), l1 l2 being the determinant. (The sampled inclination itself, S_12 /
/// (l1 - l2), is not normal for ellipses that are nearly round.)
double orientation_error(const XyCovariance& sampled, const XyCovariance& expected, double inclination_deg,
                         std::size_t n);

/// Largest difference between the entries of a sampled covariance and the expected one, in standard errors of a normal
/// cloud of n points: Var(S_ab) = (C_aa C_bb + C_ab^2) / (n - 1).
double worst_covariance_error(const XyCovariance& sampled, const XyCovariance& expected, std::size_t n);

/// Distance of a sampled mean from the expected one in units of its standard error: the Mahalanobis distance under
/// covariance / n. Infinite if the covariance is singular.
double mean_error(const Xy& sampled, const Xy& expected, const XyCovariance& covariance, std::size_t n);

/// Area of the convex hull of points; 0 for fewer than three.
double hull_area(std::span<const Xy> points);

}  // namespace lowlux::isp
