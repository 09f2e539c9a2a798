#pragma once

#include <array>
#include <cstddef>

#include "isp/base/cfa.h"

/// Figures of a Bayer cell, by colour or by site.
namespace lowlux::isp {

/// How many of its sites are red, green and blue, of all.
inline constexpr std::array<double, 3> share_of_sites{0.25, 0.5, 0.25};

/// Mean over the sites of a figure that each colour has.
constexpr double mean_of_colours(const std::array<double, 3>& of_colour) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += share_of_sites[c] * of_colour[c];
  return sum;
}

constexpr double mean_of_sites(const PerSite<double>& of_site) {
  return (of_site[0] + of_site[1] + of_site[2] + of_site[3]) / 4;
}

}  // namespace lowlux::isp
