#include "denoise/spatial/site_slopes.h"

#include <algorithm>
#include <numbers>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/rows.h"

namespace lowlux::denoise {

SiteSlopes site_slopes(BayerPhase phase) {
  const float x = red_column(phase) == 0 ? -0.5f : 0.5f, y = red_row(phase) == 0 ? -0.5f : 0.5f;
  constexpr auto per_root2 = static_cast<float>(1 / std::numbers::sqrt2);
  return {x * per_root2, y * per_root2, -x, y};
}

void repeat_luma_edges(const PlaneSet& planes, int columns, int rows, const Workers& workers) {
  in_bands(workers, rows, [&](int first, int last, int) {
    for (int y = first; y < last; ++y) {
      float* const own = planes.row(0, y);
      own[-1] = own[0];
      own[columns] = own[columns - 1];
    }
  });
}

LumaRows luma_rows(const PlaneSet& planes, int y, int rows) {
  return {planes.row(0, std::max(y - 1, 0)), planes.row(0, y), planes.row(0, std::min(y + 1, rows - 1))};
}

void subtract_slopes(const PyramidLevel& level, BayerPhase phase, int columns, int rows, const Workers& workers) {
  const SiteSlopes back = site_slopes(phase);
  const SiteSlopes off{-back.c2_x, -back.c2_y, -back.c3_x, -back.c3_y};
  repeat_luma_edges(level.noisy, columns, rows, workers);
  in_bands(workers, rows, [&](int first, int last, int) {
    for (int y = first; y < last; ++y) {
      const LumaRows luma = luma_rows(level.noisy, y, rows);
      float* const chroma[2] = {level.noisy.row(2, y), level.noisy.row(3, y)};
      rows::add_slope_row({luma.above, luma.own, luma.below}, columns, {off.c2_x, off.c2_y, off.c3_x, off.c3_y},
                          chroma);
      for (float* const row : chroma) {
        for (int x = columns; x < level.width; ++x) row[x] = row[mirrored(x, columns)];
      }
    }
  });
  for (int y = rows; y < level.height; ++y) {
    for (int p = 2; p < 4; ++p) std::copy_n(level.noisy.row(p, mirrored(y, rows)), level.width, level.noisy.row(p, y));
  }
}

}  // namespace lowlux::denoise
