#pragma once

#include <cstdint>

#include "isp/render/night/look_parameters.h"

namespace lowlux::isp {

/// Describes the noise of vision in one cell of the grid: the number of isomerisations of its rods, and of its L and M
/// cones, in their integration times is a Poisson variable, of light and of dark light (isp/model/vision/retina.h).
/// What is drawn is divided by the isomerisations of a unit of light, so that the deviation is in the pixels' unit.
struct VisualNoise {
  struct Kind {
    float counts_per_cd_m2;  // mean isomerisations by light: per scotopic cd/m2 for rods
    float dark_counts;       // mean isomerisations without light
    float units_per_count;   // light in the pixels' unit that makes one isomerisation: for rods relative to white
  };
  Kind rods;
  Kind cones;
  std::uint64_t seed;
};
VisualNoise visual_noise(const NightLook& look);

/// Draws the deviations of one row of cells from their means, whose own mean is 0 in every cell. Each depends on seed,
/// column and row only. Means above poisson_max_mean are drawn at that limit and their deviation is scaled by the
/// square root of the ratio, which keeps mean and variance.
/// @param cones_cd_m2, rods_cd_m2  luminances of the cells, >= 0 and finite
/// @param rods, cones  deviations of light seen by each alone, in the pixels' unit
/// @param scratch  as long as a row
void visual_noise_row(const VisualNoise& noise, int y, int n, const float* cones_cd_m2, const float* rods_cd_m2,
                      float* cones, float* rods, float* scratch);

}  // namespace lowlux::isp
