#include "tests/reference/noise_ratio_ref.h"

#include <algorithm>
#include <cmath>

#include "denoise/spatial/layout.h"

namespace lowlux::reference {

double ratio_at_cell(const denoise::RawElectronsView& raw, int cell_x, int cell_y) {
  const NoiseRatioView& given = raw.noise_ratio;
  if (given.ratio.data == nullptr) return 1;
  const auto block = [&](int cell, int px, int corner_px, int blocks) {
    const int square = cell / 2 * 2, cells = (px + 1) / 2;
    const int centre_px = denoise::mirrored(square, cells) + denoise::mirrored(square + 1, cells) + 1;
    return std::min((corner_px + centre_px) / given.block_px, blocks - 1);
  };
  return static_cast<double>(given.ratio.at(block(cell_x, raw.value.width, given.x_px, given.ratio.width),
                                            block(cell_y, raw.value.height, given.y_px, given.ratio.height)));
}

double ratio_of_tile(const denoise::RawElectronsView& raw, int tile_x, int tile_y, int tiles_x, int tiles_y) {
  const NoiseRatioView& given = raw.noise_ratio;
  if (given.ratio.data == nullptr) return 1;
  double sum = 0, count = 0;
  for (int y = 0; y < raw.value.height; ++y) {
    for (int x = 0; x < raw.value.width; ++x) {
      if (denoise::tile_of(x / 2, tiles_x) != tile_x || denoise::tile_of(y / 2, tiles_y) != tile_y) continue;
      sum += static_cast<double>(given.ratio.at(std::min((given.x_px + x) / given.block_px, given.ratio.width - 1),
                                                std::min((given.y_px + y) / given.block_px, given.ratio.height - 1)));
      ++count;
    }
  }
  return sum / count;
}

}  // namespace lowlux::reference
