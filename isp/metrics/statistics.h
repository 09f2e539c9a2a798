#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "isp/model/colour/chromaticity_cloud.h"

namespace lowlux::isp {

/// A sampled value counts as different from its expectation beyond this many standard errors.
inline constexpr double confidence_errors = 5;

/// Pairs a value with its standard error.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// Returns the mean of at least two samples.
Estimate mean_of(std::span<const double> samples);

/// Returns the exponent of the power law y ~ x^exponent, by weighted least squares of log y over log x.
/// @param x      positive, not all equal
/// @param log_y  natural logarithms with their standard errors (> 0), as many
Estimate power_law_exponent(std::span<const double> x, std::span<const Estimate> log_y);

/// Returns the natural logarithm of the size (thesis 4.5.2) of a cloud's ellipse, as sampled by a normal cloud of n
/// points: size^2 is the trace t of C, and Var(t) = 2 trace(C^2) / (n - 1).
Estimate log_size_of(const XyCovariance& covariance, std::size_t n);

/// Returns the difference of a sampled covariance's orientation from an inclination, in standard errors of a normal
/// cloud of n points with the expected covariance and that inclination: the sampled covariance of the two principal
/// axes, which is 0 in the mean and has Var = l1 l2 / (n - 1), l1 l2 being the determinant. (The sampled inclination
/// itself, S_12 / (l1 - l2), is not normal for ellipses that are nearly round.)
double orientation_error(const XyCovariance& sampled, const XyCovariance& expected, double inclination_deg,
                         std::size_t n);

/// Returns the largest difference between the entries of a sampled covariance and the expected one, in standard errors
/// of a normal cloud of n points: Var(S_ab) = (C_aa C_bb + C_ab^2) / (n - 1).
double worst_covariance_error(const XyCovariance& sampled, const XyCovariance& expected, std::size_t n);

/// Returns the distance of a sampled mean from the expected one in units of its standard error: the Mahalanobis
/// distance under covariance / n. It is infinite if the covariance is singular.
double mean_error(const Xy& sampled, const Xy& expected, const XyCovariance& covariance, std::size_t n);

/// Returns the median, the upper of the two middle values of an even number; 0 for none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the relative spread of times: half the distance of their quartiles, linear between values, over the median.
/// It is not a number for fewer than two.
inline double spread_of(std::vector<double> times) {
  if (times.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  std::sort(times.begin(), times.end());
  const auto quantile = [&times](double share) {
    const double place = share * static_cast<double>(times.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, times.size() - 1);
    return std::lerp(times[below], times[above], place - static_cast<double>(below));
  };
  return (quantile(0.75) - quantile(0.25)) / (2 * quantile(0.5));
}

}  // namespace lowlux::isp
