#include "isp/raw/bin_plane.h"

namespace lowlux::isp {

void bin_plane(PlaneView<const float> in, PlaneView<float> out, Executor& executor) {
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float* above = in.row(2 * y);
      const float* below = in.row(2 * y + 1);
      float* row = out.row(y);
      for (int x = 0; x < out.width; ++x) {
        row[x] = 0.25f * ((above[2 * x] + above[2 * x + 1]) + (below[2 * x] + below[2 * x + 1]));
      }
    }
  });
}

}  // namespace lowlux::isp
