#include "isp/merge/exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lowlux::merge {
namespace {

constexpr int ratio_block = 16;
constexpr std::size_t min_blocks = 16;
constexpr double max_relative_error = 0.02;
constexpr double max_deviation = 5;         // standard deviations
constexpr double stated_uncertainty = 0.2;  // of the ratio by the stated exposures
constexpr auto fade_from = static_cast<float>(full_weight_fraction);
constexpr float fade_to = 0.95F;  // of saturation

/// Holds the sums of both frames over a block without NaN sites.
struct BlockSums {
  double reference = 0, frame = 0;
  double reference_variance = 0, frame_variance = 0;
};

std::optional<BlockSums> sums_of(const FrameView& reference, const FrameView& frame, int x0, int y0) {
  BlockSums out;
  for (int y = y0; y < y0 + ratio_block; ++y) {
    for (int x = x0; x < x0 + ratio_block; ++x) {
      const auto r = static_cast<double>(reference.signal_e.at(x, y)), f = static_cast<double>(frame.signal_e.at(x, y));
      if (std::isnan(r) || std::isnan(f)) return std::nullopt;
      out.reference += r;
      out.frame += f;
      out.reference_variance += reference.variance_e2[site_of(x, y)];
      out.frame_variance += frame.variance_e2[site_of(x, y)];
    }
  }
  out.reference_variance += std::max(out.reference, 0.0);
  out.frame_variance += std::max(out.frame, 0.0);
  return out;
}

/// Returns the ratio of the sums over blocks that agree with `expected` within `tolerance` of it and the noise.
std::optional<LightRatio> ratio_near(const std::vector<BlockSums>& blocks, double expected, double tolerance) {
  double reference = 0, frame = 0, variance = 0;
  std::size_t count = 0;
  for (const BlockSums& block : blocks) {
    const double difference = block.frame - expected * block.reference;
    const double v = block.frame_variance + expected * expected * block.reference_variance;
    const double allowed = max_deviation * std::sqrt(v) + tolerance * expected * std::max(block.reference, 0.0);
    if (std::fabs(difference) > allowed) continue;
    reference += block.reference;
    frame += block.frame;
    variance += v;
    ++count;
  }
  if (count < min_blocks || !(reference > 0) || !(frame > 0)) return std::nullopt;
  return LightRatio{frame / reference, std::sqrt(variance) / reference};
}

class Weighting {
 public:
  Weighting(const FrameView& frame, double light, const std::array<double, 3>& saturation_e)
      : frame_(frame), light2_(static_cast<float>(light * light)) {
    for (int site = 0; site < 4; ++site) {
      offset_[site] = static_cast<float>(frame.variance_e2[site]);
      saturation_[site] =
          static_cast<float>(saturation_e[static_cast<std::size_t>(colour_at(frame.phase, site & 1, site >> 1))]);
    }
  }

  float at(int x, int y) const {
    const PlaneView<const float>& signal = frame_.signal_e;
    if (std::isnan(signal.at(x, y))) return 0;
    float sum = 0, valid = 0, inside = 0;
    for (int v = y - 2; v <= y + 2; v += 2) {
      for (int u = x - 2; u <= x + 2; u += 2) {
        if ((u == x && v == y) || u < 0 || v < 0 || u >= signal.width || v >= signal.height) continue;
        inside += 1;
        const float neighbour = signal.at(u, v);
        if (std::isnan(neighbour)) continue;
        sum += neighbour;
        valid += 1;
      }
    }
    const int site = site_of(x, y);
    const float mean = valid > 0 ? sum / valid : 0;
    float fade = std::clamp((fade_to - mean / saturation_[site]) / (fade_to - fade_from), 0.0F, 1.0F);
    if (inside > 0) fade *= valid / inside;
    return fade * light2_ / std::max(std::max(mean, 0.0F) + offset_[site], 1e-6F);
  }

 private:
  const FrameView& frame_;
  float light2_;
  std::array<float, 4> offset_{};
  std::array<float, 4> saturation_{};
};

}  // namespace

void remove_saturated(PlaneView<float> signal_e, BayerPhase phase, const std::array<double, 3>& saturation_e,
                      PlaneView<float> saturated, Executor& executor) {
  for_each_index(executor, signal_e.height, [&](int y) {
    for (int x = 0; x < signal_e.width; ++x) {
      float& value = signal_e.at(x, y);
      const double limit = saturation_e[static_cast<std::size_t>(colour_at(phase, x, y))];
      saturated.at(x, y) = static_cast<double>(value) >= limit ? 1 : 0;
      if (saturated.at(x, y) == 1) value = std::numeric_limits<float>::quiet_NaN();
    }
  });
}

std::optional<LightRatio> measure_light_ratio(const FrameView& reference, const FrameView& frame, double expected,
                                              Executor& executor) {
  const int rows = frame.signal_e.height / ratio_block, columns = frame.signal_e.width / ratio_block;
  std::vector<std::vector<BlockSums>> of_row(static_cast<std::size_t>(rows));
  for_each_index(executor, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      if (auto sums = sums_of(reference, frame, ratio_block * column, ratio_block * row)) {
        of_row[row].push_back(*sums);
      }
    }
  });
  std::vector<BlockSums> blocks;
  for (const auto& row : of_row) blocks.insert(blocks.end(), row.begin(), row.end());
  std::optional<LightRatio> found = ratio_near(blocks, expected, stated_uncertainty);
  for (int i = 0; found && i < 3; ++i) found = ratio_near(blocks, found->ratio, 0);
  if (!found || found->standard_error > max_relative_error * found->ratio) return std::nullopt;
  return found;
}

void inverse_variance_weights(const FrameView& frame, double light, const std::array<double, 3>& saturation_e,
                              PlaneView<float> weight, Executor& executor) {
  const Weighting weighting(frame, light, saturation_e);
  for_each_index(executor, weight.height, [&](int y) {
    for (int x = 0; x < weight.width; ++x) weight.at(x, y) = weighting.at(x, y);
  });
}

}  // namespace lowlux::merge
