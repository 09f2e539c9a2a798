#include "isp/base/random/exact_draw.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lowlux {
namespace {

/// Returns c[0] + c[1] x + c[2] x^2 ...
template <std::size_t kCount>
double polynomial(const std::array<double, kCount>& c, double x) {
  double sum = 0;
  for (std::size_t i = kCount; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

double probability(double r) { return (r + 0.5) * 0x1p-32; }

/// Returns ln k! - ln(sqrt(2 pi k) (k/e)^k), for k >= 1, by Stirling's series, Abramowitz and Stegun 6.1.41, whose next
/// term is below 2e-18 for k >= 16; for smaller k from a table.
double stirling_error(double k) {
  constexpr std::array<double, 15> table{
      0.081061466795327258, 0.041340695955409294, 0.027677925684998339, 0.020790672103765093, 0.016644691189821193,
      0.013876128823070748, 0.011896709945891770, 0.010411265261972096, 0.009255462182712733, 0.008330563433362871,
      0.007573675487951841, 0.006942840107209530, 0.006408994188004207, 0.005951370112758848, 0.005554733551962801};
  if (k < 16) return table[static_cast<std::size_t>(k) - 1];
  const double x = 1 / (k * k);
  return (1.0 / 12 - x * (1.0 / 360 - x * (1.0 / 1260 - x * (1.0 / 1680 - x * (1.0 / 1188 - x * 691.0 / 360360))))) / k;
}

/// Returns k ln(k / mean) + mean - k without cancellation where k is close to mean.
double deviance(double k, double mean) {
  const double difference = k - mean;
  if (std::abs(difference) >= 0.1 * (k + mean)) return k * std::log(k / mean) - difference;
  const double v = difference / (k + mean);
  // ln(k / mean) = 2 artanh(v), so the deviance is difference * v + 2 k (v^3/3 + v^5/5 + ...).
  double sum = difference * v, power = 2 * k * v;
  for (int i = 3;; i += 2) {
    power *= v * v;
    const double next = sum + power / i;
    if (next == sum) return sum;
    sum = next;
  }
}

/// Returns the Poisson probability in saddle-point form (Loader, "Fast and accurate computation of binomial
/// probabilities", 2000).
double poisson_probability(double k, double mean) {
  if (k == 0) return std::exp(-mean);
  return std::exp(-stirling_error(k) - deviance(k, mean)) / std::sqrt(2 * std::numbers::pi * k);
}

constexpr double negligible = 1e-18;  // terms below this fraction of a sum are ignored

/// Returns F(k; mean) for k not much above the mean, summed from its largest term outwards.
double lower_tail(double k, double mean) {
  double term = 1, sum = 0;
  for (double j = k; term > negligible * sum; --j) {
    sum += term;
    term *= j / mean;
  }
  return poisson_probability(k, mean) * sum;
}

/// Returns 1 - F(k; mean) for k not much below the mean.
double upper_tail(double k, double mean) {
  double term = 1, sum = 0;
  for (double j = k + 2; term > negligible * sum; ++j) {
    sum += term;
    term *= mean / j;
  }
  return poisson_probability(k + 1, mean) * sum;
}

/// Returns whether F(k; mean) >= u. Above 1/2 the complements are compared: F itself has too few digits near 1.
bool reaches(double k, std::uint32_t r, double mean) {
  if (r < 0x80000000U) return lower_tail(k, mean) >= probability(r);
  return upper_tail(k, mean) <= probability(~r);
}

/// Steps from `k`, which is close, to the smallest count that reaches u.
double search(double k, std::uint32_t r, double mean) {
  while (!reaches(k, r, mean)) ++k;
  while (k > 0 && reaches(k - 1, r, mean)) --k;
  return k;
}

/// Returns the quantile, or at worst a neighbour of it. The loop ends: rounding keeps the sum within 1e-14 of 1, and u
/// is 1e-10 below.
double sum_up(double u, double mean) {
  double term = std::exp(-mean), reached = term, k = 0;
  while (reached < u) {
    term *= mean / ++k;
    reached += term;
  }
  return k;
}

}  // namespace

double exact_normal(std::uint32_t r) {
  const bool lower = r < 0x80000000U;
  const double p = probability(lower ? r : ~r);  // in (0, 1/2]
  const double w = -std::log(4 * p * (1 - p));
  // This is the fit of random-inl.h, accurate to 1e-8, with its coefficients.
  const double above = polynomial(std::array{1.2533141251, 0.44745332857, 0.091010784584, 0.012525197581,
                                             1.1383759937e-3, 5.9378103919e-5, 1.9161539078e-7},
                                  w);
  const double below =
      polynomial(std::array{1.0, 0.095216431109, 0.034657760061, 2.3120644624e-3, 2.4859308607e-4, 3.7440786095e-6}, w);
  double x = (2 * p - 1) * above / below;
  // One step of Halley's method has an error of third order: 1e-8 becomes less than rounding.
  const double excess = 0.5 * std::erfc(-x / std::numbers::sqrt2) - p;
  const double newton = excess * std::sqrt(2 * std::numbers::pi) * std::exp(0.5 * x * x);
  x -= newton / (1 + 0.5 * x * newton);
  return lower ? x : -x;
}

double exact_poisson(std::uint32_t r, double mean) {
  assert(mean >= 0 && mean <= 1e6);
  if (mean == 0) return 0;
  if (mean < 12) return search(sum_up(probability(r), mean), r, mean);
  // Cornish-Fisher, as in random-inl.h: its error bound decides whether the count has to be checked.
  const double w = exact_normal(r), s = std::sqrt(mean), w2 = w * w, w4 = w2 * w2;
  const double t =
      mean + s * w + (1.0 / 3 + w2 / 6) - w * (1.0 / 36 + w2 / 72) / s + (-8.0 / 405 + 7 * w2 / 810 + w4 / 270) / mean;
  const double bound = (0.02 + w4 * (0.004 + 0.001 * w2)) / (mean * s) + 1e-13 * (mean + s * std::abs(w));
  const double k = std::floor(t - bound);
  if (k >= 0 && k == std::floor(t + bound)) return k;
  return search(std::max(0.0, std::floor(t)), r, mean);
}

}  // namespace lowlux
