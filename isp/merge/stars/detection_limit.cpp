#include "isp/merge/stars/detection_limit.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "isp/merge/stars/background.h"

namespace lowlux::merge {
namespace {

double upper_tail(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }
double normal_density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

/// Sites of the filter that share one coefficient.
struct Term {
  double coefficient;  // c, for one electron
  double count;
  double mean_e;
  double variance_e2;
};

/// Cumulant generating function of the filtered noise and its first two derivatives.
struct Cumulants {
  double k = 0;
  double k1 = 0;
  double k2 = 0;
};

Cumulants cumulants_at(const std::vector<Term>& terms, double s) {
  Cumulants out;
  for (const Term& term : terms) {
    const double c = term.coefficient, growth = std::expm1(s * c);
    out.k += term.count * (term.mean_e * (growth - s * c) + s * s * c * c * term.variance_e2 / 2);
    out.k1 += term.count * (term.mean_e * c * growth + s * c * c * term.variance_e2);
    out.k2 += term.count * c * c * (term.mean_e * (growth + 1) + term.variance_e2);
  }
  return out;
}

double tail_at(const Cumulants& at, double s) {
  const double r = std::sqrt(2 * std::max(s * at.k1 - at.k, 1e-12)), q = s * std::sqrt(at.k2);
  return upper_tail(r) + normal_density(r) * (1 / q - 1 / r);
}

std::vector<Term> terms_of(std::span<const float> taps, const PerSite<double>& mean_e,
                           const PerSite<double>& variance_e2) {
  std::vector<Term> terms;
  for (std::size_t j = 0; j < taps.size(); ++j) {
    for (std::size_t i = 0; i <= j; ++i) {
      const double places = (i == 0 ? 1 : 2) * (j == 0 ? 1 : 2) * (i == j ? 1 : 2);
      for (std::size_t s = 0; s < 4; ++s) {
        const double mean = std::max(mean_e[s], 0.0), variance = std::max(mean + variance_e2[s], min_variance_e2);
        const double tap = static_cast<double>(taps[i]) * static_cast<double>(taps[j]);
        terms.push_back({tap / std::sqrt(variance), places / 4, mean, variance - mean});
      }
    }
  }
  return terms;
}

}  // namespace

double detection_limit(std::span<const float> taps, const PerSite<double>& mean_e, const PerSite<double>& variance_e2,
                       double probability) {
  assert(probability >= 1e-12 && probability <= 0.1);
  const std::vector<Term> terms = terms_of(taps, mean_e, variance_e2);
  double lower = 1e-3, upper = 1e-3;  // limits of s; the tail falls as s rises
  while (tail_at(cumulants_at(terms, upper), upper) > probability) upper *= 2;
  for (int i = 0; i < 40; ++i) {
    const double middle = (lower + upper) / 2;
    (tail_at(cumulants_at(terms, middle), middle) > probability ? lower : upper) = middle;
  }
  return cumulants_at(terms, upper).k1;
}

}  // namespace lowlux::merge
