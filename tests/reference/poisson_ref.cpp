#include "tests/reference/poisson_ref.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <cmath>
#include <numbers>

namespace lowlux::reference {
namespace {

long double probability(long double k, long double mean) {
  return mean == 0 ? (k == 0 ? 1.0L : 0.0L) : std::exp(k * std::log(mean) - mean - std::lgamma(k + 1));
}

/// Returns F(k) = P(k) (1 + k/mean + k (k-1)/mean^2 + ...): all terms are positive, none cancels.
long double lower_tail(long double k, long double mean) {
  if (k < 0) return 0;
  const long double per_mean = 1 / mean;
  long double term = 1, sum = 0;
  for (long double j = k; term > 0 && (j >= mean || term > 1e-20L * sum); --j) {
    sum += term;
    term *= j * per_mean;
  }
  return probability(k, mean) * sum;
}

/// Returns 1 - F(k) = P(k+1) (1 + mean/(k+2) + mean^2/((k+2)(k+3)) + ...), which keeps its digits where F is close to
/// 1.
long double upper_tail(long double k, long double mean) {
  long double term = 1, sum = 0;
  for (long double j = k + 2; j <= mean || term > 1e-20L * sum; ++j) {
    sum += term;
    term *= mean / j;
  }
  return probability(k + 1, mean) * sum;
}

}  // namespace

double probability_of_word(std::uint32_t r) { return (r + 0.5) * 0x1p-32; }

double poisson_probability(double k, double mean) { return static_cast<double>(probability(k, mean)); }

double poisson_count(std::uint32_t r, double mean) {
  if (mean == 0) return 0;
  const long double u = probability_of_word(r);
  const auto reaches = [&](long double k) {
    return u < 0.5L ? lower_tail(k, mean) >= u : upper_tail(k, mean) <= 1 - u;
  };
  double k = std::max(0.0, std::floor(mean + std::sqrt(mean) * normal_deviate(r)));
  while (!reaches(k)) ++k;
  while (k > 0 && reaches(k - 1)) --k;
  return k;
}

double normal_deviate(std::uint32_t r) {
  return -std::numbers::sqrt2 * boost::math::erfc_inv(2 * probability_of_word(r));
}

}  // namespace lowlux::reference
