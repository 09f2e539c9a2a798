#include "isp/pipeline/plan/levels.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "isp/raw/corrections.h"

namespace lowlux::isp {
namespace {

std::array<double, 3> by_colour(const RawDn& raw, const PerSite<double>& sites) {
  std::array<double, 3> out{};
  for (int site = 0; site < 4; ++site) {
    out[static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1))] = sites[site];
  }
  return out;
}

}  // namespace

bool renders_from_codes(const RawFrame& frame, const RawLevels& levels, bool reduces_noise) {
  return frame.raw.layout == SensorLayout::bayer && !frame.raw.is_float() && !reduces_noise && levels.defects.empty() &&
         !levels.dark_frame && !levels.black.pattern && levels.black.dark_mean_e == PerSite<double>{} &&
         frame.corrections.radial_gains.empty() && std::ranges::none_of(frame.corrections.gain_maps, has_effect);
}

std::array<double, 3> saturated_from(const RawDn& raw, const RawLevels& levels) {
  if (!levels.saturation) return {1, 1, 1};
  PerSite<double> fraction{};
  for (int site = 0; site < 4; ++site) {
    const double pedestal_dn = levels.black.pedestal_dn[site];
    fraction[site] = (levels.saturation->from_dn() - pedestal_dn) / (white_at(raw, site) - pedestal_dn);
  }
  return by_colour(raw, fraction);
}

double black_variance_e2(const RawFrame& frame, const RawLevels& levels, int site, int colour, double electrons,
                         double e_per_dn) {
  const NoiseProfile& noise = *frame.noise;
  const BlackPoint& black = levels.black;
  const double rounding_e2 = frame.raw.is_float() ? 0 : e_per_dn * e_per_dn / 12;
  double variance_e2 = std::max(noise.offset[colour] * electrons * electrons, rounding_e2);
  const bool is_of_image = noise.source == NoiseProfile::Source::picture;
  if (!is_of_image || black.source != BlackPoint::Source::masked_pixels) {
    variance_e2 = std::max(variance_e2, std::pow(black.noise_std_dn[site] * e_per_dn, 2));
  }
  if (levels.dark_frame) variance_e2 += levels.dark_frame->added_variance_dn2[site] * e_per_dn * e_per_dn;
  return variance_e2;
}

std::array<double, 3> electrons_by_colour(const RawDn& raw, const RawLevels& levels) {
  return by_colour(raw, *levels.electrons_at_white);
}

PerSite<double> light_at_white_e(const RawLevels& levels) {
  PerSite<double> out = *levels.electrons_at_white;
  for (int site = 0; site < 4; ++site) {
    out[site] -= levels.black.dark_mean_e[site];
    assert(out[site] > 0);
  }
  return out;
}

std::array<double, 3> light_at_white_by_colour(const RawDn& raw, const RawLevels& levels) {
  return by_colour(raw, light_at_white_e(levels));
}

}  // namespace lowlux::isp
