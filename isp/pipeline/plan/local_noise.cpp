#include "isp/pipeline/plan/local_noise.h"

#include <algorithm>
#include <cstdint>

namespace lowlux::isp {
namespace {

/// Returns the first pixel of a block. Blocks are taken as equally large, although the last may be smaller.
int edge_of(int block, int blocks, int px) { return static_cast<int>(std::int64_t{block} * px / blocks); }

}  // namespace

double ratio_of_block(const RawFrame& frame, const Thumbnail& thumbnail, int column, int row) {
  if (!frame.noise_ratio) return 1;
  const Rect& active = frame.raw.active;
  const int columns = thumbnail.mean.width(), rows = thumbnail.mean.height();
  const int left = edge_of(column, columns, active.width), top = edge_of(row, rows, active.height);
  return view_of(frame.noise_ratio.get())
      .mean(left, top, std::max(edge_of(column + 1, columns, active.width) - left, 1),
            std::max(edge_of(row + 1, rows, active.height) - top, 1));
}

denoise::RawNoise median_noise(const RawFrame& frame, denoise::RawNoise noise) {
  const double ratio = median_ratio(frame.noise_ratio.get());
  for (double& dark : noise.dark_mean_e) dark = std::min(ratio * dark, denoise::largest_e);
  for (double& variance : noise.variance_e2) variance = std::min(ratio * variance, denoise::largest_e);
  return noise;
}

}  // namespace lowlux::isp
