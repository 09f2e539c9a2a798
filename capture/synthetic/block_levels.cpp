#include "capture/synthetic/block_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "capture/synthetic/optics/crosstalk.h"

namespace lowlux::capture {
namespace {

/// Pixels left to right and top to bottom, the last ones excluded.
struct BlockArea {
  int left, top, right, bottom;
};

/// Calls look(colour, before, after) for each pixel, with its rate without and with crosstalk [e-/s].
template <class Look>
void for_each_rate(const SensorFrame& frame, const BlockArea& area, const Look& look) {
  std::array<float, isp::effect_block> mixed{};
  const Crosstalk crosstalk{frame.sensor.crosstalk, frame.masked_columns};
  const int width = area.right - area.left;
  for (int y = area.top; y < area.bottom; ++y) {
    const float* before = frame.rate_e_per_s.row(y) + area.left;
    const float* after = before;
    if (crosstalk.fraction > 0) {
      mix_neighbours(frame.rate_e_per_s, crosstalk, area.left, y,
                     std::span(mixed).first(static_cast<std::size_t>(width)));
      after = mixed.data();
    }
    for (int i = 0; i < width; ++i) {
      look(static_cast<int>(colour_at(frame.phase, area.left + i, y)), before[i], after[i]);
    }
  }
}

isp::BlockLevel signal_level(const SensorFrame& frame, const BlockArea& area) {
  Vector3 sum{};
  std::array<int, 3> count{};
  float peak = 0;
  std::array<float, 3> darkest;
  darkest.fill(std::numeric_limits<float>::infinity());
  for_each_rate(frame, area, [&](int k, float, float rate) {
    sum[k] += rate;
    ++count[k];
    peak = std::max(peak, rate);
    darkest[k] = std::min(darkest[k], rate);
  });
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

/// Sums over the pixels of one colour in a block [e-/s]: of the signal, and of what crosstalk adds to it.
struct AddedSums {
  int count = 0;
  double signal = 0, signal_square = 0;
  double added = 0, moved = 0, added_square = 0, product = 0;
  double darkest_before = std::numeric_limits<double>::infinity(), peak_before = 0;

  void take(double before, double after) {
    const double more = after - before;
    ++count;
    signal += after;
    signal_square += after * after;
    added += more;
    moved += std::fabs(more);
    added_square += more * more;
    product += after * more;
    darkest_before = std::min(darkest_before, before);
    peak_before = std::max(peak_before, before);
  }
};

/// Adds what crosstalk changes in a block whose signal is known.
void add_crosstalk(const SensorFrame& frame, const BlockArea& area, isp::BlockLevel& block) {
  std::array<AddedSums, 3> sums;
  for_each_rate(frame, area, [&](int k, float before, float after) { sums[k].take(before, after); });
  const double time_s = frame.exposure.time_s, time2 = time_s * time_s;
  isp::BlockLevel::Crosstalk& out = block.crosstalk;
  for (int k = 0; k < 3; ++k) {
    if (sums[k].count == 0) continue;
    const double n = sums[k].count, mean = sums[k].signal / n, added = sums[k].added / n;
    const double variance = std::max(0.0, sums[k].added_square / n - added * added);
    out.mean_e[k] = time_s * added;
    out.moved_e[k] = time_s * sums[k].moved / n;
    out.variance_e2[k] = time2 * variance;
    out.contrast_e2[k] = time2 * std::max(0.0, sums[k].signal_square / n - mean * mean);
    // Var(a) - Var(a - d) = 2 Cov(a, d) - Var(d)
    out.more_contrast_e2[k] = time2 * (2 * (sums[k].product / n - mean * added) - variance);
    block.darkest_e[k] = std::min(block.darkest_e[k], time_s * sums[k].darkest_before);
    block.peak_e = std::max(block.peak_e, time_s * sums[k].peak_before);
  }
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
      if (frame.sensor.crosstalk > 0) add_crosstalk(frame, area, block);
      if (glow.present()) block.glow = glow_level(glow, area);
      blocks.push_back(block);
    }
  }
  return blocks;
}

}  // namespace lowlux::capture
