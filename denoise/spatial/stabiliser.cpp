#include "denoise/spatial/stabiliser.h"

#include <algorithm>
#include <cstddef>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/rows.h"

namespace lowlux::denoise {

double stabilising_offset(const std::array<double, 3>& dark_e, const RawNoise& noise, double max_ratio,
                          const DenoiseOptions& options) {
  const double scale = max_ratio * *std::max_element(options.variance_scale.begin(), options.variance_scale.end());
  double offset_e = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double steady_e = 10 * std::max(max_ratio, 1.0) + 2 * scale * (dark_e[k] + noise.variance_e2[k]);
    offset_e = std::max(offset_e, options.white_gain[k] * steady_e);
  }
  return offset_e;
}

void removed_noise(const PyramidLevel& level, const PlaneSet& value, double offset_e, int columns, int rows,
                   const Workers& workers, std::span<float> out) {
  const int tiles_x = tiles_of(columns), tiles_y = tiles_of(rows);
  in_bands(workers, tiles_y, [&](int first, int last, int) {
    for (int i = first * tiles_x; i < last * tiles_x; ++i) {
      const int tile_x = i % tiles_x, tile_y = i / tiles_x;
      const int left = tile_x * tile, right = tile_x + 1 == tiles_x ? columns : left + tile;
      const int bottom = tile_y + 1 == tiles_y ? rows : (tile_y + 1) * tile;
      double removed = 0, stated = 0;
      for (int y = tile_y * tile; y < bottom; y += 3) {
        rows::RemovedRow in{};
        for (int p = 0; p < 4; ++p) {
          in.noisy[p] = level.noisy.row(p, y) + left;
          in.value[p] = value.row(p, y) + left;
          in.variance[p] = level.variance.row(p, y / 2) + left / 2;
        }
        in.cells = right - left;
        in.offset_e = static_cast<float>(offset_e);
        const rows::RemovedSums sums = rows::removed_row(in);
        removed += static_cast<double>(sums.removed);
        stated += static_cast<double>(sums.stated);
      }
      out[static_cast<std::size_t>(i)] = stated > 0 ? static_cast<float>(removed / stated) : 0.0f;
    }
  });
}

}  // namespace lowlux::denoise
