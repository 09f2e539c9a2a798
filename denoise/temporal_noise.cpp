#include "denoise/temporal_noise.h"

#include <algorithm>
#include <array>

namespace lowlux::denoise {

rows::SiteNoise site_noise(const RawNoise& noise, BayerPhase phase) {
  const PerSite<int> site = sites_of(phase);
  const auto& dark = noise.dark_mean_e;
  const std::array dark_e{dark[site[0]], (dark[site[1]] + dark[site[2]]) / 2, dark[site[3]]};
  rows::SiteNoise out{};
  for (int c = 0; c < 3; ++c) {
    out.dark_e[c] = static_cast<float>(dark_e[c]);
    out.variance_e2[c] = static_cast<float>(noise.variance_e2[c]);
    out.least_e2[c] = static_cast<float>(0.5 * noise.variance_e2[c] + 0.3 * dark_e[c] + 0.02);
    // Subtracted as the kernels do it: what is saturated stays so by every bit.
    out.saturation_e[c] = static_cast<float>(std::min(noise.saturation_e[c], largest_value_e)) - out.dark_e[c];
  }
  return out;
}

double variance_of(const rows::SiteNoise& noise, std::size_t colour, double signal_e) {
  const double told =
      signal_e + static_cast<double>(noise.dark_e[colour]) + static_cast<double>(noise.variance_e2[colour]);
  return std::max(told, static_cast<double>(noise.least_e2[colour]));
}

}  // namespace lowlux::denoise
