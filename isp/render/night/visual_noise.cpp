#include "isp/render/night/visual_noise.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "isp/base/look_grid.h"
#include "isp/base/random/random.h"
#include "isp/model/vision/retina.h"

namespace lowlux::isp {
namespace {

VisualNoise::Kind kind_of(const ReceptorField& cell, double cd_m2_per_unit) {
  return {static_cast<float>(cell.counts_per_cd_m2), static_cast<float>(cell.dark_counts),
          static_cast<float>(1 / (cell.counts_per_cd_m2 * cd_m2_per_unit))};
}

/// Holds what is drawn from, and what for, in one row of cells.
struct KindOfRow {
  DrawStream stream;
  VisualNoise::Kind kind;
  const float* cd_m2;
  float* deviation;
};

void deviations_row(const KindOfRow& row, int y, int n, float* counts) {
  const VisualNoise::Kind& kind = row.kind;
  float* const out = row.deviation;
  const auto size = static_cast<std::size_t>(n);
  for (int x = 0; x < n; ++x) out[x] = kind.counts_per_cd_m2 * row.cd_m2[x] + kind.dark_counts;
  poisson_row(row.stream, 0, static_cast<std::uint32_t>(y), std::span<const float>(out, size),
              std::span<float>(counts, size));
  for (int x = 0; x < n; ++x) {
    const float drawn = std::min(out[x], poisson_max_mean);
    const float scale = out[x] > drawn ? std::sqrt(out[x] / drawn) : 1.0f;
    out[x] = (counts[x] - drawn) * scale * kind.units_per_count;
  }
}

}  // namespace

VisualNoise visual_noise(const NightLook& look) {
  const double side_deg = LookGrid::cell / look.pixels_per_degree;
  const double area_deg2 = side_deg * side_deg;
  const double pupil_mm2 = pupil_area_mm2(adapted_pupil_mm(look.scene_cd_m2));
  return {kind_of(rods_in(area_deg2, pupil_mm2), look.cd_m2_per_unit * look.scotopic_ratio_of_white),
          kind_of(cones_in(area_deg2, pupil_mm2), look.cd_m2_per_unit), look.seed};
}

void visual_noise_row(const VisualNoise& noise, int y, int n, const float* cones_cd_m2, const float* rods_cd_m2,
                      float* cones, float* rods, float* scratch) {
  const DrawStream of_rods{.seed = noise.seed, .frame = 0, .purpose = draw_purpose::visual_noise_rods};
  const DrawStream of_cones{.seed = noise.seed, .frame = 0, .purpose = draw_purpose::visual_noise_cones};
  deviations_row({of_rods, noise.rods, rods_cd_m2, rods}, y, n, scratch);
  deviations_row({of_cones, noise.cones, cones_cd_m2, cones}, y, n, scratch);
}

}  // namespace lowlux::isp
