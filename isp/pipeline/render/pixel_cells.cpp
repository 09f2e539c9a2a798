#include "isp/pipeline/render/pixel_cells.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/raw/repair.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

/// Returns 1 or -1 for a pixel, without order: the mixing function of SplitMix64.
float sign_at(int x, int y) {
  std::uint64_t mixed = (std::uint64_t{static_cast<std::uint32_t>(y)} << 32) | static_cast<std::uint32_t>(x);
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111eb;
  return (mixed >> 63) != 0 ? 1.0f : -1.0f;
}

}  // namespace

void read_pixels(const RawFrame& frame, const RawLevels& levels, const Rect& part,
                 std::span<const PlaneView<float>> out, Executor& executor) {
  if (planes_of(frame.raw) == 1) {
    subtract_black(frame.raw, levels, part, out[0], executor);
  } else {
    to_fraction_rgb(frame.raw, levels.black, part, {out[0], out[1], out[2]}, executor);
  }
  for (const PlaneView<float>& plane : out) repair(plane, {part.x, part.y}, levels.defects, 1);
}

void make_cells(std::span<const PlaneView<const float>> planes, const CellCharge& charge, PlaneView<float> cells,
                Executor& executor) {
  const std::size_t last = planes.size() - 1;
  const auto colour = [&](std::size_t c) { return planes[c < last ? c : last]; };
  assert(cells.width == 2 * planes[0].width && cells.height == 2 * planes[0].height);
  const std::array electrons{static_cast<float>(charge.cell_e[0]), static_cast<float>(charge.cell_e[1]),
                             static_cast<float>(charge.cell_e[2])};
  const auto dark_variance = static_cast<float>(charge.half_variance_e2.value_or(0));
  const float share = charge.half_variance_e2 ? 0.5f : 0.0f;
  for_each_band(executor, planes[0].height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float *const red = colour(0).row(y), *const green = colour(1).row(y), *const blue = colour(2).row(y);
      float *const upper = cells.row(2 * y), *const lower = cells.row(2 * y + 1);
      for (int x = 0; x < planes[0].width; ++x) {
        const float half = electrons[1] * green[x];
        const float ratio = charge.noise_ratio.is_one() ? 1.0f : charge.noise_ratio.at(x, y);
        const float deviation =
            sign_at(charge.x + x, charge.y + y) * std::sqrt(share * ratio * (std::max(half, 0.0f) + dark_variance));
        upper[2 * x] = electrons[0] * red[x];
        upper[2 * x + 1] = half - deviation;
        lower[2 * x] = half + deviation;
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
