#include "isp/merge/block_test.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "isp/merge/block_rows.h"

namespace lowlux::merge {
namespace {

constexpr double neighbour_statistics = 6;  // independent statistics of a block: two, and half of eight of its squares

double normal_quantile(double tail) {
  double low = -10, high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::numbers::sqrt2) / 2 > tail ? low : high) = middle;
  }
  return (low + high) / 2;
}

rows::BlockNoise noise_of(const MosaicNoise& reference, const MosaicNoise& frame) {
  rows::BlockNoise out{};
  const double s = reference.fraction, f = frame.fraction;
  for (int i = 0; i < 4; ++i) {
    const double r = s * reference.variance_e2[i], k = f * frame.variance_e2[i];
    out.reference_offset[i] = static_cast<float>(r);
    out.frame_offset[i] = static_cast<float>(k);
    out.offset[i] = static_cast<float>(r + k);
  }
  out.reference_slope = static_cast<float>(s);
  out.frame_slope = static_cast<float>(f);
  out.slope = static_cast<float>(s + f);
  out.third = static_cast<float>(f * f - s * s);
  out.fourth = static_cast<float>(s * s * s + f * f * f);
  return out;
}

/// Holds the sums of one block.
struct Sums {
  float spread = 0;           // sum d^2 / V, without the four means
  float spread_mean = 0;      // expected
  float spread_variance = 0;  // predicted
  std::array<float, 4> d{};   // for each site of the cell
  std::array<float, 4> v{};
  std::array<float, 4> fourth{};  // sum of fourth cumulants

  void add(const Sums& o) {
    spread += o.spread;
    spread_mean += o.spread_mean;
    spread_variance += o.spread_variance;
    for (int i = 0; i < 4; ++i) {
      d[i] += o.d[i];
      v[i] += o.v[i];
      fourth[i] += o.fourth[i];
    }
  }
};

/// Returns the normal deviate of a variable that is assumed to be gamma distributed.
float deviate(float x, float mean, float variance) {
  if (!(mean > 0) || !(variance > 0)) return -10;
  const float root_shape = mean / std::sqrt(variance);
  const float part = 1 / (9 * root_shape * root_shape);
  return (std::cbrt(std::max(x, 0.0F) / mean) - (1 - part)) * 3 * root_shape;
}

float step_deviate(const Sums& s) {
  float step = 0, count = 0, variance = 0;
  for (int i = 0; i < 4; ++i) {
    if (!(s.v[i] > 0)) continue;
    step += s.d[i] * s.d[i] / s.v[i];
    count += 1;
    variance += 2 + s.fourth[i] / (s.v[i] * s.v[i]);
  }
  return deviate(step, count, variance);
}

float worst_deviate(const Sums& s) {
  return std::max(step_deviate(s), deviate(s.spread, s.spread_mean, s.spread_variance));
}

/// Returns the statistics of the sums of one block.
Sums statistics_of(const rows::BlockSums& block) {
  Sums out{.spread = block.spread};
  float classes = 0;
  for (int i = 0; i < 4; ++i) {
    out.d[i] = block.d[i];
    out.v[i] = block.v[i];
    out.fourth[i] = block.fourth[i];
    if (!(block.v[i] > 0)) continue;
    out.spread -= block.d[i] * block.d[i] / block.v[i];
    classes += 1;
  }
  out.spread_mean = block.count - classes;
  if (out.spread_mean < 1) return {};
  out.spread_variance = block.spread_variance * out.spread_mean / block.count;
  return out;
}

/// Adds up a block at the border, of which some sites or neighbours do not exist.
rows::BlockSums add_border_block(PlaneView<const float> reference, PlaneView<float> frame, int x0, int y0,
                                 const rows::BlockNoise& noise, const rows::BlockLimits& limits) {
  constexpr int around = 2, stride = block_px + 2 * around;
  std::array<float, static_cast<std::size_t>(stride) * stride> wide{};
  std::array<float, static_cast<std::size_t>(block_px) * block_px> own{};
  wide.fill(std::numeric_limits<float>::quiet_NaN());
  own.fill(std::numeric_limits<float>::quiet_NaN());
  for (int y = std::max(y0 - around, 0); y < std::min(y0 + block_px + around, reference.height); ++y) {
    for (int x = std::max(x0 - around, 0); x < std::min(x0 + block_px + around, reference.width); ++x) {
      wide[static_cast<std::size_t>(y - y0 + around) * stride + static_cast<std::size_t>(x - x0 + around)] =
          reference.at(x, y);
    }
  }
  const int width = std::min(block_px, frame.width - x0), height = std::min(block_px, frame.height - y0);
  const auto row_of_own = [&](int y) { return own.data() + static_cast<std::ptrdiff_t>(y) * block_px; };
  for (int y = 0; y < height; ++y) std::copy_n(frame.row(y0 + y) + x0, width, row_of_own(y));
  const rows::BlockSums out =
      rows::add_block(wide.data() + around * stride + around, stride, own.data(), block_px, noise, limits);
  for (int y = 0; y < height; ++y) std::copy_n(row_of_own(y), width, frame.row(y0 + y) + x0);
  return out;
}

/// Adds up the block whose corner is (x0, y0).
rows::BlockSums add_block(PlaneView<const float> reference, PlaneView<float> frame, int x0, int y0,
                          const rows::BlockNoise& noise, const rows::BlockLimits& limits) {
  const bool inner = x0 >= 2 && y0 >= 2 && x0 + block_px + 2 <= frame.width && y0 + block_px + 2 <= frame.height;
  if (!inner) return add_border_block(reference, frame, x0, y0, noise, limits);
  return rows::add_block(reference.row(y0) + x0, reference.stride, frame.row(y0) + x0, frame.stride, noise, limits);
}

constexpr std::uint8_t matches = 0, matches_alone = 1, differs = 2;

/// Holds one value for each block, and the square of 2 x 2 blocks that begins with it.
struct Grid {
  int columns, rows;
  std::vector<Sums> sums;
  std::vector<float> alone;   // worst deviate of the block
  std::vector<float> square;  // worst deviate of the square
  std::vector<std::uint8_t> state;

  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * columns + x; }
};

/// Finds the deviates of squares without the blocks that differ by themselves, which would make their neighbours
/// differ.
/// @param alone_differs  whether the block at (x, y) differs by itself
template <class Differs>
void find_squares(Grid& grid, int y, const Differs& alone_differs) {
  for (int x = 0; x < grid.columns; ++x) {
    Sums square;
    for (int v = y; v < std::min(y + 2, grid.rows); ++v) {
      for (int u = x; u < std::min(x + 2, grid.columns); ++u) {
        if (!alone_differs(u, v)) square.add(grid.sums[grid.at(u, v)]);
      }
    }
    grid.square[grid.at(x, y)] = worst_deviate(square);
  }
}

/// @param thresholds  those of the block at a column
template <class ThresholdsOf>
void judge(Grid& grid, int y, const ThresholdsOf& thresholds) {
  for (int x = 0; x < grid.columns; ++x) {
    float worst = grid.alone[grid.at(x, y)];
    for (int v = std::max(y - 1, 0); v <= y; ++v) {
      for (int u = std::max(x - 1, 0); u <= x; ++u) worst = std::max(worst, grid.square[grid.at(u, v)]);
    }
    const auto& at = thresholds(x);
    grid.state[grid.at(x, y)] = worst > at.alone ? differs : worst > at.neighbour ? matches_alone : matches;
  }
}

bool block_matches(const Grid& grid, int x, int y) {
  const std::uint8_t own = grid.state[grid.at(x, y)];
  if (own != matches_alone) return own == matches;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, grid.rows - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, grid.columns - 1); ++u) {
      if (grid.state[grid.at(u, v)] == differs) return false;
    }
  }
  return true;
}

/// Adds the figures of the whole frame, row by row, so that they do not depend on the number of threads.
void summarise(const Grid& grid, const std::vector<std::int64_t>& outliers, Comparison& out) {
  double chi_square = 0, sites = 0, compared = 0, matching = 0;
  for (int y = 0; y < grid.rows; ++y) {
    out.outliers += outliers[y];
    for (int x = 0; x < grid.columns; ++x) {
      const Sums& s = grid.sums[grid.at(x, y)];
      if (!(s.spread_mean > 0)) continue;
      chi_square += static_cast<double>(s.spread);
      sites += static_cast<double>(s.spread_mean);
      compared += 1;
      matching += out.block_matches.at(x, y);
    }
  }
  out.mean_chi_square = sites > 0 ? chi_square / sites : 0;
  out.matching_fraction = compared > 0 ? matching / compared : 0;
}

}  // namespace

MosaicNoise noise_in_light(const PerSite<double>& variance_e2, double light) {
  MosaicNoise out{.fraction = 1 / light};
  for (int i = 0; i < 4; ++i) out.variance_e2[i] = variance_e2[i] / light;
  return out;
}

MosaicComparer::Thresholds MosaicComparer::thresholds_of(double block_false_alarm, double site_false_alarm) {
  const double alone = block_false_alarm / (2 * neighbour_statistics);
  return {static_cast<float>(normal_quantile(alone)), static_cast<float>(normal_quantile(std::cbrt(alone))),
          site_false_alarm > 0 ? static_cast<float>(normal_quantile(site_false_alarm / 2)) : 0};
}

MosaicComparer::MosaicComparer(const MosaicNoise& reference_noise, const MosaicNoise& frame_noise,
                               const ComparisonOptions& options)
    : options_(options),
      noise_{noise_of(reference_noise, frame_noise), noise_of(options.single_frame.noise, frame_noise)},
      thresholds_{thresholds_of(options.block_false_alarm, options.site_false_alarm),
                  thresholds_of(options.single_frame.block_false_alarm, options.site_false_alarm)} {}

Comparison MosaicComparer::compare(PlaneView<const float> reference, PlaneView<float> frame, Executor& executor) const {
  assert(reference.width == frame.width && reference.height == frame.height);
  const int columns = (frame.width + block_px - 1) / block_px, rows = (frame.height + block_px - 1) / block_px;
  const std::size_t blocks = static_cast<std::size_t>(columns) * rows;
  Grid grid{columns,
            rows,
            std::vector<Sums>(blocks),
            std::vector<float>(blocks),
            std::vector<float>(blocks),
            std::vector<std::uint8_t>(blocks)};
  const PlaneView<const std::uint8_t> is_single = options_.single_frame.is_single;
  const auto kind = [&](int x, int y) { return is_single.data != nullptr ? is_single.at(x, y) : 0; };
  const auto error_px = static_cast<float>(options_.displacement_error_px);
  const rows::BlockLimits limits{thresholds_[0].site, error_px * error_px};
  std::vector<std::int64_t> outliers(rows);
  for_each_index(executor, rows, [&](int y) {
    for (int x = 0; x < columns; ++x) {
      const rows::BlockSums block = add_block(reference, frame, block_px * x, block_px * y, noise_[kind(x, y)], limits);
      outliers[y] += block.outliers;
      Sums& sums = grid.sums[grid.at(x, y)];
      sums = statistics_of(block);
      grid.alone[grid.at(x, y)] = worst_deviate(sums);
    }
  });
  Comparison out{.block_matches = Plane<std::uint8_t>(columns, rows)};
  const auto alone_differs = [&](int x, int y) { return grid.alone[grid.at(x, y)] > thresholds_[kind(x, y)].alone; };
  for_each_index(executor, rows, [&](int y) { find_squares(grid, y, alone_differs); });
  for_each_index(executor, rows,
                 [&](int y) { judge(grid, y, [&](int x) -> const Thresholds& { return thresholds_[kind(x, y)]; }); });
  for_each_index(executor, rows, [&](int y) {
    for (int x = 0; x < columns; ++x) out.block_matches.at(x, y) = block_matches(grid, x, y) ? 1 : 0;
  });
  summarise(grid, outliers, out);
  return out;
}

Comparison compare_mosaics(PlaneView<const float> reference, const MosaicNoise& reference_noise, PlaneView<float> frame,
                           const MosaicNoise& frame_noise, const ComparisonOptions& options, Executor& executor) {
  return MosaicComparer(reference_noise, frame_noise, options).compare(reference, frame, executor);
}

}  // namespace lowlux::merge
