#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "denoise/spatial/point_sources.h"
#include "tests/denoise/frames.h"

/// The search for point sources on its own.
namespace lowlux::denoise_testing {

/// Memory for one thread, and a search on it.
struct Searcher {
  explicit Searcher(int width) : rows(18 * (width + 512)), found(width) {
    const auto row = [&](int i) { return rows.data() + static_cast<std::ptrdiff_t>(i) * (width + 512) + 32; };
    for (int i = 0; i < 14; ++i) memory.pair[i] = row(i);
    for (int i = 0; i < 2; ++i) memory.sums[i] = row(14 + i);
    memory.ratio = row(16);
    memory.scratch = {rows.data(), 17 * (width + 512) * sizeof(float)};
    close_scratch(memory.scratch);
    memory.found = found.data();
  }
  Plane<std::uint8_t> operator()(const Plane<float>& raw, const Camera& camera, const NoiseRatioView& ratio = {}) {
    Plane<std::uint8_t> cells((raw.width() + 1) / 2, (raw.height() + 1) / 2);
    InlineExecutor one;
    denoise::find_point_sources({raw.view(), camera.phase, ratio}, camera.noise(), {one, 1}, &memory, cells.view());
    return cells;
  }
  std::vector<float> rows;
  std::vector<std::int32_t> found;
  denoise::SearchMemory memory;
};

inline long marked(const Plane<std::uint8_t>& cells) {
  return std::count(cells.data(), cells.data() + cells.size(), 1);
}

/// Noise of the sum of one cell.
inline double cell_sigma_e(const Camera& camera, double signal_e) {
  double variance = 0;
  for (const double dark : camera.dark_e) variance += signal_e + dark + camera.read_noise_e * camera.read_noise_e;
  return std::sqrt(variance);
}

}  // namespace lowlux::denoise_testing
