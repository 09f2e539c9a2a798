#include "isp/bench/stages/count_laws.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace lowlux::isp {
namespace {

double at(std::span<const double> law, std::size_t k) { return k < law.size() ? law[k] : 1; }

}  // namespace

std::vector<double> poisson_law(double mean) {
  assert(mean > 0 && mean <= 1e6);
  // The size is 12 standard deviations, plus a margin for small means: the rest is below 1e-17.
  const auto size = static_cast<std::size_t>(mean + 12 * std::sqrt(mean) + 30);
  std::vector<double> law(size, 0.0);
  const auto mode = static_cast<std::size_t>(mean);
  law[mode] = 1;
  for (std::size_t k = mode; k + 1 < size; ++k) law[k + 1] = law[k] * mean / static_cast<double>(k + 1);
  for (std::size_t k = mode; k > 0; --k) law[k - 1] = law[k] * static_cast<double>(k) / mean;
  std::partial_sum(law.begin(), law.end(), law.begin());
  for (double& f : law) f /= law.back();
  return law;
}

std::vector<double> law_of_words(const std::function<double(std::uint32_t)>& count_of_word, std::size_t counts) {
  std::vector<double> law(counts);
  std::uint64_t first = 0;  // first word that gives more than k - 1
  for (std::size_t k = 0; k < counts; ++k) {
    std::uint64_t last = std::uint64_t{1} << 32;  // all words below `first` give k or less; those from `last` on more
    while (first < last) {
      const std::uint64_t middle = first + (last - first) / 2;
      if (count_of_word(static_cast<std::uint32_t>(middle)) <= static_cast<double>(k)) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    law[k] = static_cast<double>(first) * 0x1p-32;
  }
  return law;
}

double kolmogorov_distance(std::span<const double> law, std::span<const double> other) {
  double largest = 0;
  for (std::size_t k = 0; k < std::max(law.size(), other.size()); ++k) {
    largest = std::max(largest, std::fabs(at(law, k) - at(other, k)));
  }
  return largest;
}

double kolmogorov_distance(std::vector<float> sample, std::span<const double> law) {
  assert(!sample.empty());
  std::ranges::sort(sample);
  // Between integers the distribution is constant and the sample's rises, so that comparing the ends suffices.
  const auto count = static_cast<double>(sample.size());
  const auto fraction_to = [&](auto end) { return static_cast<double>(end - sample.begin()) / count; };
  double largest = fraction_to(std::ranges::lower_bound(sample, 0.0F));
  for (std::size_t k = 0; at(law, k) < 1 || static_cast<double>(k) <= static_cast<double>(sample.back()); ++k) {
    const auto here = static_cast<float>(k), next = static_cast<float>(k + 1);
    largest = std::max({largest, std::fabs(fraction_to(std::ranges::upper_bound(sample, here)) - at(law, k)),
                        std::fabs(fraction_to(std::ranges::lower_bound(sample, next)) - at(law, k))});
  }
  return largest;
}

double kolmogorov_limit(std::size_t samples) { return (0.8687 + 5 * 0.2603) / std::sqrt(static_cast<double>(samples)); }

double variance_of_law(std::span<const double> law) {
  double mean = 0, square = 0, below = 0;
  const auto middle = static_cast<double>(std::ranges::lower_bound(law, 0.5) - law.begin());
  for (std::size_t k = 0; k <= law.size(); ++k) {
    const double p = at(law, k) - below, from_middle = static_cast<double>(k) - middle;
    mean += p * from_middle;
    square += p * from_middle * from_middle;
    below += p;
  }
  return square - mean * mean;
}

float rounded_normal_count(float mean, float z) { return std::max(0.0F, std::nearbyint(mean + std::sqrt(mean) * z)); }

}  // namespace lowlux::isp
