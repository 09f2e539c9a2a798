#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isp/base/plane.h"
#include "isp/raw/measure/tile_noise.h"

namespace lowlux::test {

/// Gives tiles the sums of a frame's columns by plain loops, a row of tiles at a time.
inline void measure(const Plane<std::uint16_t>& frame, isp::TileNoise& tiles) {
  for (int row = 0; row < tiles.tile_rows(); ++row) {
    const auto width = static_cast<std::size_t>(frame.width());
    std::array<std::vector<std::uint32_t>, 2> sum{std::vector<std::uint32_t>(width), std::vector<std::uint32_t>(width)};
    auto square = sum;
    for (int y = row * tiles.tile(); y < (row + 1) * tiles.tile(); ++y) {
      for (int x = 0; x < frame.width(); ++x) sum[y & 1][x] += frame.at(x, y);
      for (int x = 0; x + 2 < frame.width(); ++x) {
        const int difference = frame.at(x, y) - frame.at(x + 2, y);
        square[y & 1][x] += static_cast<std::uint32_t>(difference * difference);
      }
    }
    tiles.add_columns({sum[0].data(), sum[1].data()}, {square[0].data(), square[1].data()}, row);
  }
}

}  // namespace lowlux::test
