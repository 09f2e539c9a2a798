#pragma once

#include <cstdint>

namespace lowlux {

/// The quantities of random.h for one word r in double precision: what the kernels ask when float cannot decide.
/// u = (r + 1/2) / 2^32.

/// Smallest k with F(k; mean) >= u, F being the Poisson CDF. May err by 1 where F(k) and u, or
/// 1 - F(k) and 1 - u, agree to 13 digits.
/// @param mean [events], 0..1e6
double exact_poisson(std::uint32_t r, double mean);

/// Standard normal quantile of u, to 1e-14.
double exact_normal(std::uint32_t r);

}  // namespace lowlux
