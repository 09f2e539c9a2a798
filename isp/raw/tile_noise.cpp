#include "isp/raw/tile_noise.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>

namespace lowlux::isp {
namespace {

constexpr double low_rank = 0.2;
constexpr int levels = 32;          // half octaves of DN above black
constexpr int variance_bins = 256;  // eighths of an octave
constexpr int least_samples = 40;   // of a level

/// Of one level: a histogram of variances, and the sum of means.
struct Level {
  std::array<std::uint32_t, variance_bins> bin{};
  std::uint32_t samples = 0;
  double sum = 0;
};

/// Eight bins for each octave, even within it: the high bits of a float.
constexpr int bin_shift = 20;
constexpr std::uint32_t lowest_bin = std::bit_cast<std::uint32_t>(0x1p-8F) >> bin_shift;

int bin_of_variance(float v) {
  const std::uint32_t bin = std::bit_cast<std::uint32_t>(std::max(v, 0x1p-8F)) >> bin_shift;
  return std::min(static_cast<int>(bin - lowest_bin), variance_bins - 1);
}

/// The lower edge of a bin.
double edge_of(int bin) { return std::bit_cast<float>((lowest_bin + static_cast<std::uint32_t>(bin)) << bin_shift); }

/// Two for each octave from an eighth of a code on.
int level_of(float above_black_dn) {
  const std::uint32_t octaves = std::bit_cast<std::uint32_t>(std::max(above_black_dn, 0x1p-3F)) >> 22U;
  return std::min(static_cast<int>(octaves - (std::bit_cast<std::uint32_t>(0x1p-3F) >> 22U)), levels - 1);
}

/// The variance below which a share of the samples lies, by straight lines within bins.
double low_quantile(const Level& level, double share) {
  const double wanted = share * level.samples;
  double below = 0;
  for (int i = 0; i < variance_bins; ++i) {
    if (below + level.bin[i] >= wanted) {
      const double part = (wanted - below) / std::max(1U, level.bin[i]);
      return edge_of(i) + part * (edge_of(i + 1) - edge_of(i));
    }
    below += level.bin[i];
  }
  return 0;
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
  const double pairs = (tile / 2) * (tile / 4);
  const boost::math::chi_squared law(pairs);
  low_share_ = boost::math::quantile(law, low_rank) / pairs;
}

void TileNoise::clear() { std::ranges::fill(tiles_, Tile{}); }

void TileNoise::add_columns(const std::array<const std::uint32_t*, 2>& sums,
                            const std::array<const std::uint32_t*, 2>& squares, int tile_row) {
  if (tile_row >= rows_) return;
  Tile* const tiles = &tiles_[static_cast<std::size_t>(tile_row) * columns_];
  for (int i = 0; i < columns_; ++i) {
    for (int parity = 0; parity < 2; ++parity) {
      const std::uint32_t* const sum = sums[parity] + static_cast<std::ptrdiff_t>(i) * tile_;
      const std::uint32_t* const square = squares[parity] + static_cast<std::ptrdiff_t>(i) * tile_;
      Tile& tile = tiles[i];
      for (int x = 0; x + 3 < tile_; x += 4) {  // pairs that do not overlap: columns x and x + 2, x + 1 and x + 3
        tile.sum[2 * parity] += sum[x] + sum[x + 2];
        tile.sum[2 * parity + 1] += sum[x + 1] + sum[x + 3];
        tile.square[2 * parity] += square[x];
        tile.square[2 * parity + 1] += square[x + 1];
      }
    }
  }
}

double TileNoise::mean_of(const Tile& tile, int site) const {
  const double samples = (tile_ / 2) * 2 * (tile_ / 4);
  return tile.sum[site] / samples;
}

double TileNoise::variance_of(const Tile& tile, int site) const {
  const double pairs = (tile_ / 2) * (tile_ / 4);
  return static_cast<double>(tile.square[site]) / (2 * pairs);
}

std::optional<NoiseLine> TileNoise::line(const PerSite<double>& black_dn, double white_dn) const {
  std::array<Level, levels> found{};
  for (const Tile& tile : tiles_) {
    for (int site = 0; site < 4; ++site) {
      const double mean = mean_of(tile, site), variance = variance_of(tile, site);
      if (mean > 0.9 * white_dn || variance == 0) continue;
      Level& level = found[level_of(static_cast<float>(mean - black_dn[site]))];
      ++level.bin[bin_of_variance(static_cast<float>(variance))];
      ++level.samples;
      level.sum += mean - black_dn[site];
    }
  }
  // Relative error of the quantile of n chi-squares of k pairs: sqrt(2 / k) / (share's density), about 1.4 times that
  // of their mean.
  const double pairs = (tile_ / 2) * (tile_ / 4);
  Sums sums;
  for (const Level& level : found) {
    if (level.samples < least_samples) continue;
    const double variance = low_quantile(level, low_rank) / low_share_;
    if (!(variance > 0)) continue;
    const double relative2 = 2 * 2 / (pairs * level.samples) + 1e-4;  // and what detail adds: a hundredth
    sums.add(1 / (relative2 * variance * variance), level.sum / level.samples, variance);
  }
  const double determinant = sums.w * sums.xx - sums.x * sums.x;
  if (!(determinant > 1e-9 * sums.w * sums.xx)) return std::nullopt;
  NoiseLine out{.gain_dn = (sums.w * sums.xy - sums.x * sums.y) / determinant,
                .offset_dn2 = (sums.xx * sums.y - sums.x * sums.xy) / determinant,
                .gain_error_dn = std::sqrt(sums.w / determinant),
                .offset_error_dn2 = std::sqrt(sums.xx / determinant)};
  if (!(out.gain_dn > 4 * out.gain_error_dn)) return std::nullopt;
  out.offset_dn2 = std::max(out.offset_dn2, 1.0 / 12);  // that of rounding to codes
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
