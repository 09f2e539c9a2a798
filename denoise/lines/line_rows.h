#pragma once

#include <cstddef>

/// The kernel under differences() of lines, dispatched at run time.
namespace lowlux::denoise::rows {

/// out[i] = the median over 16 groups g of means[g stride + i + distance] - means[g stride + i], all finite, i < count.
/// @return how many were done: the last few, which fill no vector, are not
int median_differences(const double* means, std::ptrdiff_t stride, int distance, int count, double* out);

}  // namespace lowlux::denoise::rows
