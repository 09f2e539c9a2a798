#include "denoise/spatial/local_noise.h"

#include <algorithm>
#include <cstddef>

#include "denoise/spatial/layout.h"

namespace lowlux::denoise {
namespace {

/// Returns the site behind the centre of square i of two cells.
int centre_of(int i, int cells) { return mirrored(2 * i, cells) + mirrored(2 * i + 1, cells) + 1; }

bool same_block(const NoiseRatioView& ratio, int y, int other_y) {
  return (ratio.y_px + y) / ratio.block_px == (ratio.y_px + other_y) / ratio.block_px;
}

}  // namespace

void ratio_of_squares(const NoiseRatioView& ratio, int columns, int rows, int square_row, std::span<float> out) {
  const int y = centre_of(square_row, rows);
  const std::size_t inside = std::min(out.size(), static_cast<std::size_t>(columns / 2));
  ratio.row(centre_of(0, columns), 4, y, out.first(inside));
  for (std::size_t i = inside; i < out.size(); ++i) out[i] = ratio.at(centre_of(static_cast<int>(i), columns), y);
}

void ratio_of_windows(const NoiseRatioView& ratio, int y, std::span<float> out) {
  const auto width = static_cast<int>(out.size());
  ratio.row(0, 1, y, out);
  if (!same_block(ratio, y, y + 1)) {
    for (int x = 0; x < width; ++x) out[static_cast<std::size_t>(x)] += ratio.at(x, y + 1);
    for (float& sum : out) sum /= 2;
  }
  for (std::size_t x = 0; x + 1 < out.size(); ++x) out[x] = (out[x] + out[x + 1]) / 2;
}

bool same_blocks(const NoiseRatioView& ratio, int y, int other_y) {
  return same_block(ratio, y, other_y) && same_block(ratio, y + 1, other_y + 1);
}

}  // namespace lowlux::denoise
