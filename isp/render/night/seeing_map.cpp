#include "isp/render/night/seeing_map.h"

#include <cassert>
#include <cstdint>
#include <vector>

#include "isp/model/vision/detection.h"
#include "isp/render/night/light_fields.h"

namespace lowlux::isp {
namespace {

/// Holds the light of one row of cells.
struct LightOfRow {
  explicit LightOfRow(int n) : light(n), own_rods(n), cones(n), rods(n) {}
  std::vector<float> light, own_rods, cones, rods;
};

}  // namespace

double map_seeing(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                  const NightLook& look, const PlaneView<float>& probability, Executor& executor) {
  const auto model = seeing_model(pupil_area_mm2(adapted_pupil_mm(look.scene_cd_m2)));
  assert(model);
  const rows::LightWeights weights = light_weights(look, matrix, clip);
  const int width = probability.width;
  for_each_band(executor, probability.height, [&](RowBand band, int) {
    LightOfRow row(width);
    for (int y = band.first; y < band.last; ++y) {
      rows::light_row({{camera[0].row(y), camera[1].row(y), camera[2].row(y)}}, weights, width, row.light.data(),
                      row.own_rods.data());
      field_row(look, width, row.light.data(), row.own_rods.data(), row.cones.data(), row.rods.data());
      for (int x = 0; x < width; ++x) {
        probability.row(y)[x] = static_cast<float>(probability_of_seeing(*model, {row.cones[x], row.rods[x]}));
      }
    }
  });
  std::int64_t seen = 0;
  for (int y = 0; y < probability.height; ++y) {
    for (int x = 0; x < width; ++x) seen += probability.row(y)[x] > 0.5f ? 1 : 0;
  }
  return static_cast<double>(seen) / width / probability.height;
}

}  // namespace lowlux::isp
