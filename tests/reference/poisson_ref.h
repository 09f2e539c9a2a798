#pragma once

#include <cstdint>

namespace lowlux::reference {

/// Returns (r + 1/2) / 2^32.
double probability_of_word(std::uint32_t r);

/// Returns P(k; mean) of a Poisson variable, from its definition in long double.
double poisson_probability(double k, double mean);

/// Returns the smallest k with F(k; mean) >= probability_of_word(r): the CDF as a sum of its terms in long double,
/// relative error below 1e-12 for means up to 1e6. Shares nothing with the library.
double poisson_count(std::uint32_t r, double mean);

/// Returns the standard normal quantile of probability_of_word(r), by Boost.Math.
double normal_deviate(std::uint32_t r);

}  // namespace lowlux::reference
