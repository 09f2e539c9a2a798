#pragma once

#include <cstddef>

/// The kernel under differences() of line_noise.h, dispatched at run time.
namespace lowlux::denoise::rows {

/// Computes out[i] = the median over 16 groups g of means[g stride + i + distance] - means[g stride + i], all finite, i
/// < count.
/// @return the number computed: the last few, which do not fill a vector, are not
int median_differences(const double* means, std::ptrdiff_t stride, int distance, int count, double* out);

}  // namespace lowlux::denoise::rows
