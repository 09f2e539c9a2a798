#include "denoise/picture/box_mean.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace lowlux::denoise {

Plane<double> box_mean(const Plane<double>& values, int radius) {
  assert(radius >= 0 && radius <= 64);
  const int width = values.width(), height = values.height();
  Plane<double> row_sum(width, height), out(width, height);
  Plane<int> row_count(width, height);
  for (int y = 0; y < height; ++y) {
    const double* in = values.row(y);
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      int count = 0;
      for (int i = std::max(x - radius, 0); i <= std::min(x + radius, width - 1); ++i) {
        if (!std::isfinite(in[i])) continue;
        sum += in[i];
        ++count;
      }
      row_sum.at(x, y) = sum;
      row_count.at(x, y) = count;
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      int count = 0;
      for (int j = std::max(y - radius, 0); j <= std::min(y + radius, height - 1); ++j) {
        sum += row_sum.at(x, j);
        count += row_count.at(x, j);
      }
      out.at(x, y) = count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return out;
}

}  // namespace lowlux::denoise
