#include "isp/model/spectrum/spectral_divergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace lowlux::isp {
namespace {

/// Returns the spectrum with the floor applied, at an integral of 1; nullopt without light.
std::optional<Spectrum> density_of(const Spectrum& measured) {
  const double peak = *std::ranges::max_element(measured.values());
  if (!(peak > 0)) return std::nullopt;
  // The values are divided by the peak first, so that no sum overflows.
  const Spectrum held = measured.mapped([&](double, double v) { return std::max(v / peak, spectral_floor); });
  const double whole = integrate(held);
  return held.mapped([&](double, double v) { return v / whole; });
}

double divergence(const Spectrum& first, const Spectrum& second) {
  const double found = integrate(first, [&](double nm) { return std::log(first.at(nm) / second.at(nm)); });
  return std::max(found, 0.0);  // rounding can leave less than 0
}

struct Densities {
  Spectrum first;
  Spectrum second;
};

Result<Densities> densities_of(const Spectrum& first, const Spectrum& second) {
  if (!std::ranges::equal(first.wavelengths_nm(), second.wavelengths_nm())) {
    return fail(ErrorCode::malformed, "the spectra have different wavelengths, " + std::to_string(first.size()) +
                                          " and " + std::to_string(second.size()) +
                                          " of them: resample one at those of the other");
  }
  auto p = density_of(first), q = density_of(second);
  if (!p || !q) {
    return fail(ErrorCode::insufficient,
                std::string("the ") + (p ? "second" : "first") + " spectrum has no positive value: there is no light");
  }
  return Densities{*std::move(p), *std::move(q)};
}

template <std::size_t N>
double inner(const std::array<double, N>& a, const std::array<double, N>& b, const std::array<double, N>& c) {
  double sum = 0;
  for (std::size_t k = 0; k < N; ++k) sum += (a[k] - b[k]) * c[k];
  return sum;
}

}  // namespace

template <std::size_t N>
double kullback_leibler(const MaxEntropyFit<N>& first, const MaxEntropyFit<N>& second) {
  const double found = inner(first.theta, second.theta, first.moments) - first.psi + second.psi;
  return std::max(found, 0.0);  // rounding can leave less than 0
}

template <std::size_t N>
double jeffreys(const MaxEntropyFit<N>& first, const MaxEntropyFit<N>& second) {
  std::array<double, N> apart{};
  for (std::size_t k = 0; k < N; ++k) apart[k] = first.moments[k] - second.moments[k];
  return std::max(inner(first.theta, second.theta, apart), 0.0);
}

template double kullback_leibler(const MaxEntropyFit<2>&, const MaxEntropyFit<2>&);
template double kullback_leibler(const MaxEntropyFit<3>&, const MaxEntropyFit<3>&);
template double jeffreys(const MaxEntropyFit<2>&, const MaxEntropyFit<2>&);
template double jeffreys(const MaxEntropyFit<3>&, const MaxEntropyFit<3>&);

Result<double> kullback_leibler(const Spectrum& first, const Spectrum& second) {
  const auto p = densities_of(first, second);
  if (!p) return tl::make_unexpected(p.error());
  return divergence(p->first, p->second);
}

Result<double> jeffreys(const Spectrum& first, const Spectrum& second) {
  const auto p = densities_of(first, second);
  if (!p) return tl::make_unexpected(p.error());
  return divergence(p->first, p->second) + divergence(p->second, p->first);
}

}  // namespace lowlux::isp
