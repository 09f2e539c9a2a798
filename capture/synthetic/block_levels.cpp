#include "capture/synthetic/block_levels.h"

#include <algorithm>
#include <array>
#include <limits>

namespace lowlux::capture {
namespace {

/// Pixels left to right and top to bottom, the last ones excluded.
struct BlockArea {
  int left, top, right, bottom;
};

isp::BlockLevel signal_level(const SensorFrame& frame, const BlockArea& area) {
  Vector3 sum{};
  std::array<int, 3> count{};
  float peak = 0;
  std::array<float, 3> darkest;
  darkest.fill(std::numeric_limits<float>::infinity());
  for (int y = area.top; y < area.bottom; ++y) {
    const float* row = frame.rate_e_per_s.row(y);
    for (int x = area.left; x < area.right; ++x) {
      const int k = static_cast<int>(colour_at(frame.phase, x, y));
      sum[k] += row[x];
      ++count[k];
      peak = std::max(peak, row[x]);
      darkest[k] = std::min(darkest[k], row[x]);
    }
  }
  const double time_s = frame.exposure.time_s;
  const double whole = (sum[0] + sum[1] + sum[2]) / (count[0] + count[1] + count[2]);
  isp::BlockLevel block;
  block.peak_e = time_s * peak;
  for (int k = 0; k < 3; ++k) {
    block.signal_e[k] = time_s * (count[k] > 0 ? sum[k] / count[k] : whole);
    block.darkest_e[k] = count[k] > 0 ? time_s * darkest[k] : block.signal_e[k];
  }
  return block;
}

isp::BlockLevel::Glow glow_level(const isp::AmplifierGlow& glow, const BlockArea& area) {
  double sum = 0, square = 0, least = std::numeric_limits<double>::infinity(), peak = 0;
  for (int y = area.top; y < area.bottom; ++y) {
    for (int x = area.left; x < area.right; ++x) {
      const double mean_e = glow.mean_e(x, y);
      sum += mean_e;
      square += mean_e * mean_e;
      least = std::min(least, mean_e);
      peak = std::max(peak, mean_e);
    }
  }
  const double pixels = static_cast<double>(area.right - area.left) * (area.bottom - area.top), mean = sum / pixels;
  return {mean, least, peak, std::max(0.0, square / pixels - mean * mean)};
}

}  // namespace

std::vector<isp::BlockLevel> block_levels(const SensorFrame& frame) {
  const isp::AmplifierGlow glow = glow_of(frame);
  std::vector<isp::BlockLevel> blocks;
  for (int y0 = 0; y0 < frame.rate_e_per_s.height; y0 += isp::effect_block) {
    for (int x0 = 0; x0 < frame.rate_e_per_s.width; x0 += isp::effect_block) {
      const BlockArea area{x0, y0, std::min(frame.rate_e_per_s.width, x0 + isp::effect_block),
                           std::min(frame.rate_e_per_s.height, y0 + isp::effect_block)};
      isp::BlockLevel block = signal_level(frame, area);
      if (glow.present()) block.glow = glow_level(glow, area);
      blocks.push_back(block);
    }
  }
  return blocks;
}

}  // namespace lowlux::capture
