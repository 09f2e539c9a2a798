#pragma once

#include <cstdint>

namespace lowlux {

/// The functions below compute the quantities of random.h for one word r in double precision: the kernels call them if
/// float cannot decide. u = (r + 1/2) / 2^32.

/// Returns the smallest k with F(k; mean) >= u, with F the Poisson CDF. May err by 1 where F(k) and u, or 1 - F(k) and
/// 1 - u, agree to 13 digits.
/// @param mean [events], 0..1e6
double exact_poisson(std::uint32_t r, double mean);

/// Returns the standard normal quantile of u = (r + 1/2) / 2^32, to 1e-14.
double exact_normal(std::uint32_t r);

}  // namespace lowlux
