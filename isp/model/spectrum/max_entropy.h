#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace lowlux::isp {

/// Holds N functions f at the nodes of a wavelength grid, with the weight of each node in integrals [nm].
template <std::size_t N>
struct SpectralBasis {
  std::vector<std::array<double, N>> f;
  std::vector<double> weight_nm;  // one for each f
};

/// Holds the spectrum of largest entropy with given moments, p = exp(<f, theta> - psi), integral 1.
template <std::size_t N>
struct MaxEntropyFit {
  std::array<double, N> theta{};
  double psi = 0;
  std::array<double, N> moments{};  // integral of f p that was reached
  double entropy = 0;               // -integral of p log p
  int iterations = 0;
};

/// Minimises (moments - eta)^T A (moments - eta) - gamma H(p) by Newton's method on its strictly convex dual
///     D(theta) = psi(theta) - <theta, eta> + (gamma / 4) <theta, A^-1 theta>
/// with Armijo backtracking (thesis Eq. 5.1 to 5.9; Clark & Skaff 2009). The smaller gamma, the closer the moments.
/// @param inverse_a symmetric positive definite: A^-1
/// @param gamma     at least 1e-12; moments outside of the convex hull of f are met as nearly as gamma asks
/// @param start     theta to start from: the fit of a neighbour saves iterations
/// @return nullopt if an argument is not finite, gamma too small or the iteration does not settle in 60 steps
template <std::size_t N>
std::optional<MaxEntropyFit<N>> fit_max_entropy(const SpectralBasis<N>& basis, const std::array<double, N>& eta,
                                                const std::array<std::array<double, N>, N>& inverse_a, double gamma,
                                                const std::array<double, N>& start = {});

extern template std::optional<MaxEntropyFit<2>> fit_max_entropy(const SpectralBasis<2>&, const std::array<double, 2>&,
                                                                const std::array<std::array<double, 2>, 2>&, double,
                                                                const std::array<double, 2>&);
extern template std::optional<MaxEntropyFit<3>> fit_max_entropy(const SpectralBasis<3>&, const std::array<double, 3>&,
                                                                const std::array<std::array<double, 3>, 3>&, double,
                                                                const std::array<double, 3>&);

}  // namespace lowlux::isp
