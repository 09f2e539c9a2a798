#include "capture/x_trans/x_trans_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lowlux::capture {
namespace {

constexpr std::size_t levels = 16, min_blocks = 64;
constexpr double quartile_of_normal = 0.31864;  // of the absolute value of a normal deviate
constexpr int rows_used_of_all = 1200;          // rows of blocks; of larger mosaics some are skipped

/// A group of blocks of similar brightness.
struct Level {
  std::vector<float> difference;  // absolute value
  double sum = 0;                 // of the means
};

bool is_green_block(const XTransPhase& phase, int x, int y) {
  const auto green = [&](int dx, int dy) { return colour_at(phase, x + dx, y + dy) == CfaColour::green; };
  return green(0, 0) && green(1, 0) && green(0, 1) && green(1, 1);
}

std::array<Level, levels> group_blocks(PlaneView<const float> mosaic, const XTransPhase& phase) {
  std::array<Level, levels> groups;
  const int step = 3 * std::max(1, mosaic.height / (3 * rows_used_of_all));
  int first_x = 0, first_y = 0;  // blocks repeat every third row and column
  while (first_y < 3 && !is_green_block(phase, first_x, first_y)) {
    if (++first_x == 3) first_x = 0, ++first_y;
  }
  for (int y = first_y; y + 1 < mosaic.height; y += step) {
    const float *above = mosaic.row(y), *below = mosaic.row(y + 1);
    for (int x = first_x; x + 1 < mosaic.width; x += 3) {
      const double mean = (static_cast<double>(above[x]) + above[x + 1] + below[x] + below[x + 1]) / 4;
      if (mean >= 1) continue;
      Level& level = groups[static_cast<std::size_t>(std::sqrt(std::max(mean, 0.0)) * levels)];
      level.difference.push_back(std::fabs(above[x] - above[x + 1] - below[x] + below[x + 1]) / 2);
      level.sum += mean;
    }
  }
  return groups;
}

}  // namespace

NoiseLine estimate_mosaic_noise(PlaneView<const float> mosaic, const XTransPhase& phase) {
  // Least squares of relative errors, in which each level weighs by its number of blocks.
  double w = 0, wx = 0, wxx = 0, wv = 0, wxv = 0;
  for (Level& level : group_blocks(mosaic, phase)) {
    if (level.difference.size() < min_blocks) continue;
    const auto quartile = level.difference.begin() + static_cast<std::ptrdiff_t>(level.difference.size() / 4);
    std::nth_element(level.difference.begin(), quartile, level.difference.end());
    const double count = static_cast<double>(level.difference.size()), x = std::max(level.sum / count, 0.0);
    const double deviation = static_cast<double>(*quartile) / quartile_of_normal, v = deviation * deviation;
    const double weight = count / std::max(v * v, 1e-20);
    w += weight, wx += weight * x, wxx += weight * x * x, wv += weight * v, wxv += weight * x * v;
  }
  if (w == 0) return {};
  const double determinant = w * wxx - wx * wx;
  const double scale = determinant > 1e-9 * w * wxx ? (w * wxv - wx * wv) / determinant : 0;
  const double offset = (wv - scale * wx) / w;
  if (scale < 0 || wxx == 0) return {0, wv / w};
  if (offset < 0) return {wxv / wxx, 0};
  return {scale, offset};
}

}  // namespace lowlux::capture
