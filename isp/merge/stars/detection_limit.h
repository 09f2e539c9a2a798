#pragma once

#include <span>

#include "isp/base/cfa.h"

namespace lowlux::merge {

/// Returns the limit that the matched filter of pure noise exceeds at one pixel with the given probability, in standard
/// deviations of the filter. For normal noise this is the normal quantile; photons are fewer and skew, and the limit is
/// higher: it comes from the tail probability of Lugannani and Rice (Adv. Appl. Prob. 12, 1980) for the sum of c_i Y_i,
/// Y_i Poisson plus normal noise, whose cumulant generating function is
///     K(s) = sum of mean_i (exp(s c_i) - 1 - s c_i) + s^2 c_i^2 variance_i / 2,  c_i = g_i / std_i.
/// Each tap counts as the mean of the four sites of a cell.
/// @param taps        taps of the separable filter g from its centre outward; the sum of their squares over both sides
/// is 1
/// @param mean_e      background of each site, negative values count as 0
/// @param variance_e2 variance of each site, in addition to its mean
/// @param probability 1e-12..0.1
double detection_limit(std::span<const float> taps, const PerSite<double>& mean_e, const PerSite<double>& variance_e2,
                       double probability);

}  // namespace lowlux::merge
