#pragma once

#include <cstddef>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/spectrum/max_entropy.h"

namespace lowlux::isp {

/// Returns the Kullback-Leibler divergence of two fits on one basis [nat], in closed form (thesis Eq. 6.1; no logarithm
/// of 0):
///     D(p1 || p2) = <theta1 - theta2, eta1> - psi1 + psi2,  eta1 the moments that p1 has.
/// At least 0. The function cannot check that the bases were the same.
template <std::size_t N>
double kullback_leibler(const MaxEntropyFit<N>& first, const MaxEntropyFit<N>& second);

/// Returns the Jeffreys divergence of two fits on one basis [nat], symmetric (thesis Eq. 6.2, without a factor 1/2):
///     J = D(p1 || p2) + D(p2 || p1) = <theta1 - theta2, eta1 - eta2>
template <std::size_t N>
double jeffreys(const MaxEntropyFit<N>& first, const MaxEntropyFit<N>& second);

extern template double kullback_leibler(const MaxEntropyFit<2>&, const MaxEntropyFit<2>&);
extern template double kullback_leibler(const MaxEntropyFit<3>&, const MaxEntropyFit<3>&);
extern template double jeffreys(const MaxEntropyFit<2>&, const MaxEntropyFit<2>&);
extern template double jeffreys(const MaxEntropyFit<3>&, const MaxEntropyFit<3>&);

/// Limits a measured spectrum from below, as a fraction of its peak, when it is compared with another.
inline constexpr double spectral_floor = 1e-12;

/// Returns the Kullback-Leibler divergence of measured spectra of one quantity [nat], by the trapezium rule on their
/// nodes. Values below spectral_floor of the peak, including negative noise, count as that; then each integral is
/// scaled to 1, so that brightness does not matter. Where the second is dark and the first is not, the floor determines
/// the divergence: up to 27.6 nat. Errors: malformed, their wavelengths differ; insufficient, one has no positive
/// value.
Result<double> kullback_leibler(const Spectrum& first, const Spectrum& second);

/// Returns the Jeffreys divergence of measured spectra [nat]; errors as those of kullback_leibler.
Result<double> jeffreys(const Spectrum& first, const Spectrum& second);

}  // namespace lowlux::isp
