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

/// Charge rates of a row of a block [e-/s]: without the effects that move light between pixels, with the blur of the
/// lens, with crosstalk, and with both. Where the frame does not have an effect, rates with and without it are the
/// same.
struct RowRates {
  std::span<const float> none, blurred, mixed, both;
};

/// Calls look(y, rates) for each row of a block.
template <class Look>
void for_each_row(const SensorFrame& frame, const BlockArea& area, const Look& look) {
  std::array<float, isp::effect_block> mixed{}, both{};
  const Crosstalk crosstalk{frame.sensor.crosstalk, frame.masked_columns};
  const auto width = static_cast<std::size_t>(area.right - area.left);
  const PlaneView<const float>& blurred = frame.has_lens_blur() ? frame.blurred_e_per_s : frame.rate_e_per_s;
  for (int y = area.top; y < area.bottom; ++y) {
    const auto row_of = [&](const PlaneView<const float>& rate) { return std::span(rate.row(y) + area.left, width); };
    RowRates rates{row_of(frame.rate_e_per_s), row_of(blurred), row_of(frame.rate_e_per_s), row_of(blurred)};
    if (crosstalk.fraction > 0) {
      rates.both = std::span(both).first(width);
      mix_neighbours(blurred, crosstalk, area.left, y, std::span(both).first(width));
      rates.mixed = rates.both;
      if (frame.has_lens_blur()) {
        rates.mixed = std::span(mixed).first(width);
        mix_neighbours(frame.rate_e_per_s, crosstalk, area.left, y, std::span(mixed).first(width));
      }
    }
    look(y, rates);
  }
}

/// Calls look(colour, pixel, rates) for each pixel of a block.
template <class Look>
void for_each_pixel(const SensorFrame& frame, const BlockArea& area, const Look& look) {
  for_each_row(frame, area, [&](int y, const RowRates& rates) {
    for (std::size_t i = 0; i < rates.both.size(); ++i) {
      look(static_cast<int>(colour_at(frame.phase, area.left + static_cast<int>(i), y)), i, rates);
    }
  });
}

isp::BlockLevel signal_level(const SensorFrame& frame, const BlockArea& area) {
  Vector3 sum{};
  std::array<int, 3> count{};
  float peak = 0;
  std::array<float, 3> darkest;
  darkest.fill(std::numeric_limits<float>::infinity());
  for_each_pixel(frame, area, [&](int k, std::size_t i, const RowRates& rates) {
    sum[k] += rates.both[i];
    ++count[k];
    peak = std::max({peak, rates.none[i], rates.blurred[i], rates.mixed[i], rates.both[i]});
    darkest[k] = std::min({darkest[k], rates.none[i], rates.blurred[i], rates.mixed[i], rates.both[i]});
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

/// Sums over the pixels of one colour in a block: of what effects that move light add to their signal, see MovedLight.
struct MovedSums {
  double count = 0, added = 0, moved = 0, added_square = 0, product = 0;
  double variance = 0, squares_by_signal = 0, counts_by_signal = 0, counts_by_contrast = 0;

  /// @param before_e, after_e mean charge of a pixel without and with the effects
  /// @param mean_e            mean of all pixels with them
  /// @param step_e            charge of a code
  void take(double before_e, double after_e, double mean_e, double step_e) {
    const double more = after_e - before_e, off = after_e - mean_e;
    const double counts =
        isp::count_change_variance_e2(std::min(before_e, after_e), std::max(before_e, after_e), step_e);
    ++count;
    added += more;
    moved += std::fabs(more);
    added_square += more * more;
    product += off * more;
    variance += counts;
    squares_by_signal += more * more * after_e;
    counts_by_signal += counts * after_e;
    counts_by_contrast += counts * off * off;
  }
};

/// Returns what effects add that turn the rates `before` of a block to those with all effects.
/// @param mean_e mean of R, G and B pixels with them
isp::MovedLight moved_light(const SensorFrame& frame, const BlockArea& area, std::span<const float> RowRates::*before,
                            const Vector3& mean_e) {
  std::array<MovedSums, 3> sums;
  const double time_s = frame.exposure.time_s, step_e = 1 / frame.sensor.system_gain_dn_per_e;
  for_each_pixel(frame, area, [&](int k, std::size_t i, const RowRates& rates) {
    sums[static_cast<std::size_t>(k)].take(time_s * (rates.*before)[i], time_s * rates.both[i], mean_e[k], step_e);
  });
  isp::MovedLight out;
  for (int k = 0; k < 3; ++k) {
    const MovedSums& of = sums[static_cast<std::size_t>(k)];
    if (of.count == 0) continue;
    const double n = of.count, added = of.added / n;
    out.mean_e[k] = added;
    out.moved_e[k] = of.moved / n;
    out.variance_e2[k] = std::max(0.0, of.added_square / n - added * added);
    out.more_contrast_e2[k] = 2 * of.product / n - out.variance_e2[k];  // Var(s) - Var(s - d) = 2 Cov(s, d) - Var(d)
    out.count_variance_e2[k] = of.variance / n;
    out.squares_by_signal_e3[k] = of.squares_by_signal / n;
    out.counts_by_signal_e3[k] = of.counts_by_signal / n;
    out.counts_by_contrast_e4[k] = of.counts_by_contrast / n;
  }
  return out;
}

isp::Contrast contrast_of(const SensorFrame& frame, const BlockArea& area, const Vector3& mean_e) {
  isp::Contrast out;
  Vector3 count{};
  for_each_pixel(frame, area, [&](int k, std::size_t i, const RowRates& rates) {
    const double signal = frame.exposure.time_s * rates.both[i], off = signal - mean_e[k];
    ++count[k];
    out.variance_e2[k] += off * off;
    out.by_signal_e3[k] += off * off * signal;
  });
  for (int k = 0; k < 3; ++k) {
    out.variance_e2[k] /= std::max(1.0, count[k]);
    out.by_signal_e3[k] /= std::max(1.0, count[k]);
  }
  return out;
}

/// Adds what effects that move light change in a block whose signal is known.
void add_moved_light(const SensorFrame& frame, const BlockArea& area, isp::BlockLevel& block) {
  const bool mixes = frame.sensor.crosstalk > 0;
  const Vector3& mean_e = block.signal_e;
  block.contrast = contrast_of(frame, area, mean_e);
  if (frame.has_lens_blur()) block.by_lens_blur = moved_light(frame, area, &RowRates::mixed, mean_e);
  if (mixes) block.by_crosstalk = moved_light(frame, area, &RowRates::blurred, mean_e);
  block.by_both = !mixes                  ? block.by_lens_blur
                  : frame.has_lens_blur() ? moved_light(frame, area, &RowRates::none, mean_e)
                                          : block.by_crosstalk;
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
      if (frame.sensor.crosstalk > 0 || frame.has_lens_blur()) add_moved_light(frame, area, block);
      if (glow.present()) block.glow = glow_level(glow, area);
      blocks.push_back(block);
    }
  }
  return blocks;
}

}  // namespace lowlux::capture
