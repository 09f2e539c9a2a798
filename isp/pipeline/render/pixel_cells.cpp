#include "isp/pipeline/render/pixel_cells.h"

#include <cassert>
#include <cstddef>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/raw/repair.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {

void read_pixels(const RawFrame& frame, const RawLevels& levels, const Rect& part,
                 std::span<const PlaneView<float>> out, Executor& executor) {
  if (planes_of(frame.raw) == 1) {
    subtract_black(frame.raw, levels, part, out[0], executor);
  } else {
    to_fraction_rgb(frame.raw, levels.black, part, {out[0], out[1], out[2]}, executor);
  }
  for (const PlaneView<float>& plane : out) repair(plane, {part.x, part.y}, levels.defects, 1);
}

void make_cells(std::span<const PlaneView<const float>> planes, const std::array<double, 3>& cell_e,
                PlaneView<float> cells, Executor& executor) {
  const std::size_t last = planes.size() - 1;
  const auto colour = [&](std::size_t c) { return planes[c < last ? c : last]; };
  assert(cells.width == 2 * planes[0].width && cells.height == 2 * planes[0].height);
  const std::array electrons{static_cast<float>(cell_e[0]), static_cast<float>(cell_e[1]),
                             static_cast<float>(cell_e[2])};
  for_each_band(executor, planes[0].height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float *const red = colour(0).row(y), *const green = colour(1).row(y), *const blue = colour(2).row(y);
      float *const upper = cells.row(2 * y), *const lower = cells.row(2 * y + 1);
      for (int x = 0; x < planes[0].width; ++x) {
        upper[2 * x] = electrons[0] * red[x];
        upper[2 * x + 1] = lower[2 * x] = electrons[1] * green[x];
        lower[2 * x + 1] = electrons[2] * blue[x];
      }
    }
  });
}

void join_cells(PlaneView<const float> cells, const std::array<double, 3>& cell_e,
                std::span<const PlaneView<float>> planes, Executor& executor) {
  const std::array per_e{static_cast<float>(1 / cell_e[0]), static_cast<float>(1 / cell_e[1]),
                         static_cast<float>(1 / cell_e[2])};
  for_each_band(executor, planes[0].height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float *const upper = cells.row(2 * y), *const lower = cells.row(2 * y + 1);
      for (int x = 0; x < planes[0].width; ++x) {
        const float red = per_e[0] * upper[2 * x], blue = per_e[2] * lower[2 * x + 1];
        const float green = 0.5f * per_e[1] * (upper[2 * x + 1] + lower[2 * x]);
        if (planes.size() == 1) {
          planes[0].row(y)[x] = 0.25f * (red + 2 * green + blue);
        } else {
          planes[0].row(y)[x] = red;
          planes[1].row(y)[x] = green;
          planes[2].row(y)[x] = blue;
        }
      }
    }
  });
}

}  // namespace lowlux::isp
