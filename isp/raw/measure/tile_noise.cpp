#include "isp/raw/measure/tile_noise.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include "isp/base/sensor.h"

#include <boost/math/distributions/chi_squared.hpp>

namespace lowlux::isp {
namespace {

constexpr double low_rank = 0.05;
constexpr int min_samples = 60;  // of one level
/// Noise of at least half a code, rounded to codes, has the sum of both variances; for less noise, the variance depends
/// on the position of the mean between two codes.
constexpr double min_variance_dn2 = 0.25 + quantisation_dn2;

/// Bins positive floats by their leading bits: 2^mantissa_bits bins for each octave, from 2^low_octave on.
template <int mantissa_bits, int low_octave>
struct FloatBins {
  static constexpr int shift = 23 - mantissa_bits;
  static constexpr int first = (127 + low_octave) << mantissa_bits;
  static int bin_of(double v, int bins) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(std::max(v, 1e-30)));
    return std::clamp(static_cast<int>(bits >> shift) - first, 0, bins - 1);
  }
  static double edge(int bin) {
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bin + first) << shift));
  }
};
using LevelBins = FloatBins<1, -3>;  // bins of DN above black
using RatioBins = FloatBins<3, -8>;  // bins of the ratio of measured to expected variance
constexpr int levels = 40;
constexpr int ratio_bins = 256;

/// Holds the ratios of measured to expected variance and the sum of means of one level.
struct Level {
  std::array<std::uint32_t, ratio_bins> bin{};
  std::uint32_t samples = 0;
  double sum = 0;
};

/// Returns the quantile that the fraction `share` of the samples lies below, interpolated linearly within bins.
double low_quantile(const Level& level, double share) {
  const double wanted = share * level.samples;
  double below = 0;
  for (int i = 0; i < ratio_bins; ++i) {
    if (below + level.bin[i] >= wanted) {
      const double part = (wanted - below) / std::max(1U, level.bin[i]);
      return RatioBins::edge(i) + part * (RatioBins::edge(i + 1) - RatioBins::edge(i));
    }
    below += level.bin[i];
  }
  return 0;
}

double variance_at(const NoiseLine& line, double above_black_dn) {
  return std::max(line.offset_dn2 + line.gain_dn * above_black_dn, min_variance_dn2);
}

struct Sums {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  void add(double weight, double at, double value) {
    w += weight, x += weight * at, y += weight * value;
    xx += weight * at * at, xy += weight * at * value;
  }
};

}  // namespace

TileNoise::TileNoise(int width, int height, int tile)
    : tile_(tile),
      columns_(width / tile),
      rows_(height / tile),
      tiles_(static_cast<std::size_t>(columns_) * rows_),
      memory_(tiles_.size()) {
  const boost::math::chi_squared law(freedom());
  const double low = boost::math::quantile(law, low_rank);
  low_fraction_ = low / freedom();
  const double of_density = low * boost::math::pdf(law, low);
  low_error2_ = low_rank * (1 - low_rank) / (of_density * of_density);
}

void TileNoise::clear() { std::ranges::fill(tiles_, Tile{}); }

void TileNoise::add_columns(const std::array<const std::uint32_t*, 2>& sums,
                            const std::array<const std::uint32_t*, 2>& squares, int tile_row) {
  if (columns_ == 0 || tile_row >= rows_) return;
  Tile* const tiles = &tiles_[static_cast<std::size_t>(tile_row) * columns_];
  for (int i = 0; i < columns_; ++i) {
    for (int site = 0; site < 4; ++site) {
      const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(i) * tile_ + (site & 1);
      const std::uint32_t* const sum = sums[site >> 1] + first;
      const std::uint32_t* const square = squares[site >> 1] + first;
      Tile& tile = tiles[i];
      for (int x = 0; x + 3 < tile_; x += 4) {  // pairs that do not overlap
        tile.sum[site] += sum[x] + sum[x + 2];
        tile.difference[site] += static_cast<std::int32_t>(sum[x]) - static_cast<std::int32_t>(sum[x + 2]);
        tile.square[site] += square[x];
      }
    }
  }
}

double TileNoise::mean_of(const Tile& tile, int site) const {
  return static_cast<double>(tile.sum[site]) / (2 * pairs());
}

double TileNoise::variance_of(const Tile& tile, int site) const {
  const double of_slope = static_cast<double>(tile.difference[site]) * tile.difference[site] / pairs();
  return (static_cast<double>(tile.square[site]) - of_slope) / (2 * freedom());
}

std::optional<NoiseLine> TileNoise::line_by(const NoiseLine& expected, const PerSite<double>& black_dn,
                                            double white_dn) const {
  std::array<Level, levels> found{};
  for (const Tile& tile : tiles_) {
    for (int site = 0; site < 4; ++site) {
      const double mean = mean_of(tile, site), variance = variance_of(tile, site);
      if (mean > 0.9 * white_dn || variance <= 0) continue;
      const double above = mean - black_dn[site];
      Level& level = found[LevelBins::bin_of(above, levels)];
      ++level.bin[RatioBins::bin_of(variance / variance_at(expected, above), ratio_bins)];
      ++level.samples;
      level.sum += above;
    }
  }
  Sums sums;
  for (const Level& level : found) {
    if (level.samples < min_samples) continue;
    const double mean = level.sum / level.samples;
    const double variance = variance_at(expected, mean) * low_quantile(level, low_rank) / low_fraction_;
    if (!(variance > min_variance_dn2)) continue;
    const double relative2 = low_error2_ / level.samples + 1e-4;  // plus a hundredth for the effect of detail
    sums.add(1 / (relative2 * variance * variance), mean, variance);
  }
  const double determinant = sums.w * sums.xx - sums.x * sums.x;
  if (!(determinant > 1e-9 * sums.w * sums.xx)) return std::nullopt;
  NoiseLine out{.gain_dn = (sums.w * sums.xy - sums.x * sums.y) / determinant,
                .offset_dn2 = (sums.xx * sums.y - sums.x * sums.xy) / determinant,
                .gain_error_dn = std::sqrt(sums.w / determinant),
                .offset_error_dn2 = std::sqrt(sums.xx / determinant)};
  if (!(out.gain_dn > 4 * out.gain_error_dn)) return std::nullopt;
  return out;
}

std::optional<NoiseLine> TileNoise::line(const PerSite<double>& black_dn, double white_dn) const {
  // Levels are half an octave wide. A first line describes the variance within them, so that their width has no effect.
  std::optional<NoiseLine> out = line_by({.offset_dn2 = 1}, black_dn, white_dn);
  if (out) out = line_by(*out, black_dn, white_dn);
  if (out) out->offset_dn2 = std::max(out->offset_dn2, quantisation_dn2);  // variance of rounding to codes
  return out;
}

PerSite<double> TileNoise::darkest_dn() {
  PerSite<double> out{};
  for (int site = 0; site < 4 && !tiles_.empty(); ++site) {
    for (std::size_t i = 0; i < tiles_.size(); ++i) memory_[i] = static_cast<float>(mean_of(tiles_[i], site));
    const auto rank = memory_.begin() + static_cast<std::ptrdiff_t>(tiles_.size() / 100);
    std::nth_element(memory_.begin(), rank, memory_.end());
    out[site] = *rank;
  }
  return out;
}

}  // namespace lowlux::isp
