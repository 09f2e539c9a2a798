#pragma once

#include <array>
#include <cstddef>

/// States the colours of a Bayer cell, and means over them.
namespace lowlux::isp {

/// States the fractions of a cell's sites that are red, green and blue.
inline constexpr std::array<double, 3> fraction_of_sites{0.25, 0.5, 0.25};

/// Returns the mean over the sites of a value that each colour has.
constexpr double mean_of_colours(const std::array<double, 3>& of_colour) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += fraction_of_sites[c] * of_colour[c];
  return sum;
}

}  // namespace lowlux::isp
