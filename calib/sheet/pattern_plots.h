#pragma once

#include <vector>

#include "calib/dark/dark_stack.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Returns the averaged frame of a stack, each site less its own mean: deviations of pixels [DN].
Plane<float> deviations_of(const DarkGroup& group);

enum class Direction : unsigned char { along_rows, along_columns };

/// Returns the spectrogram of deviations (EMVA 1288 R4, section 8.5): the square root of the mean power of all rows, or
/// of all columns, at 0, 1, ... n / 2 cycles in n pixels, where n is the largest power of two that fits, from the first
/// pixel on. White noise has its standard deviation at every frequency.
std::vector<double> spectrogram(const Plane<float>& deviations, Direction direction);

/// Counts of deviations in bins of equal width from the least to the largest.
struct Histogram {
  std::vector<double> centre;
  std::vector<double> count;
};

/// Returns the histogram of finite values (R4, section 8.7). @param bins  1 or more
Histogram histogram_of(const Plane<float>& deviations, int bins);

}  // namespace lowlux::calib
