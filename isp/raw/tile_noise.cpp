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

/// Of one level: a histogram of log2(variance), eight bins for each octave from 2^-8 on, and the sum of means.
struct Level {
  std::array<std::uint32_t, variance_bins> bin{};
  std::uint32_t samples = 0;
  double sum = 0;
};

int bin_of_variance(double v) {
  return std::clamp(static_cast<int>(8 * (std::log2(std::max(v, 1e-9)) + 8)), 0, variance_bins - 1);
}

int level_of(double above_black_dn) {
  return std::clamp(static_cast<int>(2 * (std::log2(std::max(above_black_dn, 0.125)) + 3)), 0, levels - 1);
}

/// The variance below which a share of the samples lies, by straight lines within bins.
double low_quantile(const Level& level, double share) {
  const double wanted = share * level.samples;
  double below = 0;
  for (int i = 0; i < variance_bins; ++i) {
    if (below + level.bin[i] >= wanted) {
      const double part = (wanted - below) / std::max(1U, level.bin[i]);
      return std::exp2((i + part) / 8 - 8);
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

void TileNoise::add_row(const std::uint16_t* dn, int y) {
  if (columns_ == 0 || y / tile_ >= rows_) return;
  Tile* const tiles = &tiles_[static_cast<std::size_t>(y / tile_) * columns_];
  const int left = site_of(0, y);
  for (int i = 0; i < columns_; ++i) {
    const std::uint16_t* const in = dn + static_cast<std::ptrdiff_t>(i) * tile_;
    std::uint32_t even = 0, odd = 0;
    std::uint64_t even_square = 0, odd_square = 0;
    for (int x = 0; x + 3 < tile_; x += 4) {
      even += in[x] + in[x + 2];
      odd += in[x + 1] + in[x + 3];
      const std::int64_t a = in[x] - in[x + 2], b = in[x + 1] - in[x + 3];
      even_square += static_cast<std::uint64_t>(a * a);
      odd_square += static_cast<std::uint64_t>(b * b);
    }
    tiles[i].sum[left] += even;
    tiles[i].sum[left + 1] += odd;
    tiles[i].square[left] += even_square;
    tiles[i].square[left + 1] += odd_square;
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
      Level& level = found[level_of(mean - black_dn[site])];
      ++level.bin[bin_of_variance(variance)];
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
