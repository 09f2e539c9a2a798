#pragma once

#include <cstdint>

namespace lowlux {

/// The quantities of random.h for one word r in double precision: what the kernels ask when float cannot decide.
/// u = (r + 1/2) / 2^32.

/// Smallest k with F(k; mean) >= u, F being the Poisson CDF. Errs where u and F(k) differ by less than 1e-14.
/// @param mean [events], 0..1e6
double exact_poisson(std::uint32_t r, double mean);

/// Standard normal quantile of u, to 1e-14.
double exact_normal(std::uint32_t r);

}  // namespace lowlux
