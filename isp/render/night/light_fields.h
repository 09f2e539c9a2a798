#pragma once

#include <algorithm>
#include <array>

#include "isp/base/look_grid.h"
#include "isp/render/night/eye_rows.h"
#include "isp/render/night/look_parameters.h"

namespace lowlux::isp {

/// Returns the weights of camera RGB in the light of the pixels.
/// @param matrix  camera RGB to the pixels' primaries, rows
inline rows::LightWeights light_weights(const NightLook& look, const std::array<float, 9>& matrix, float clip) {
  rows::LightWeights out{{}, {}, clip};
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 3; ++j) {
      out.photopic[c] += look.luminance[j] * matrix[3 * j + c];
      out.scotopic[c] += look.rods[j] * matrix[3 * j + c];
    }
  }
  return out;
}

/// Limits the scotopic light of one row to at least that of low-pressure sodium light (LookGrid::min_rods), and
/// converts light in the pixels' unit to luminances of 0 to 1e9 [cd/m2; scotopic cd/m2].
/// @param own_rods  relative to white; limited in place
inline void field_row(const NightLook& look, int n, const float* light, float* own_rods, float* cones_cd_m2,
                      float* rods_cd_m2) {
  const auto cones = static_cast<float>(look.cd_m2_per_unit);
  const auto rods = static_cast<float>(look.cd_m2_per_unit * look.scotopic_ratio_of_white);
  constexpr auto min_ratio = static_cast<float>(min_field_ratio);
  for (int x = 0; x < n; ++x) own_rods[x] = std::max(own_rods[x], std::min(LookGrid::min_rods * light[x], light[x]));
  for (int x = 0; x < n; ++x) cones_cd_m2[x] = std::min(std::max(cones * light[x], 0.0f), 1e9f);
  for (int x = 0; x < n; ++x) {
    rods_cd_m2[x] = std::min(std::max(rods * own_rods[x], min_ratio * cones_cd_m2[x]), 1e9f);
  }
}

}  // namespace lowlux::isp
