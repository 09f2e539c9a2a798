#include "capture/synthetic/optics/crosstalk.h"

#include <cstddef>

namespace lowlux::capture {

void mix_neighbours(const PlaneView<const float>& rate, const Crosstalk& crosstalk, int x0, int y,
                    std::span<float> rate_out) {
  const auto fraction = static_cast<float>(crosstalk.fraction);
  const int first = crosstalk.masked_columns;
  const float* row = rate.row(y);
  const float* above = y > 0 ? rate.row(y - 1) : row;
  const float* below = y + 1 < rate.height ? rate.row(y + 1) : row;
  for (std::size_t i = 0; i < rate_out.size(); ++i) {
    const int x = x0 + static_cast<int>(i);
    const float own = row[x];
    if (x < first) {
      rate_out[i] = own;
      continue;
    }
    const float left = x > first ? row[x - 1] : own, right = x + 1 < rate.width ? row[x + 1] : own;
    const float gained = (left - own) + (right - own) + (above[x] - own) + (below[x] - own);
    rate_out[i] = own + fraction * gained;
  }
}

}  // namespace lowlux::capture
