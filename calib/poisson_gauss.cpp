#include "calib/poisson_gauss.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace lowlux::calib {
namespace {

double below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }

/// Calls visit(count, probability) for the Poisson counts that matter.
template <class Visit>
void for_each_count(double mean, const Visit& visit) {
  const double reach = 10 * std::sqrt(mean) + 40;
  const double first = std::max(0.0, std::floor(mean - reach)), last = std::ceil(mean + reach);
  const double counts = last - first + 1;  // none of a mean that is no number
  int sign = 0;                            // of the gamma function, for the form that threads may share
  for (int i = 0; i < counts; ++i) {
    const double k = first + i;
    visit(k, mean > 0 ? std::exp(k * std::log(mean) - mean - ::lgamma_r(k + 1, &sign)) : (k == 0 ? 1.0 : 0.0));
  }
}

}  // namespace

double truncation_bias_e(const PoissonGauss& law, double low_e, double high_e) {
  assert(law.normal_variance_e2 > 0);
  const double deviation = std::sqrt(law.normal_variance_e2);
  double share = 0, sum = 0;
  for_each_count(law.poisson_mean_e, [&](double k, double p) {
    const double a = (low_e - k) / deviation, b = (high_e - k) / deviation;
    const double inside = a > 0 ? below(-a) - below(-b) : below(b) - below(a);  // no cancellation in either tail
    share += p * inside;
    sum += p * ((k - law.poisson_mean_e) * inside + deviation * (density(a) - density(b)));
  });
  return share > 0 ? sum / share : 0;
}

}  // namespace lowlux::calib
