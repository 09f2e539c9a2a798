#include "isp/merge/block_test.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace lowlux::merge {
namespace {

constexpr double neighbour_statistics = 6;  // independent statistics of a block: two, and half of eight of its squares
constexpr float unexplained_excess = 3;     // standard deviations of a site's mean that its block's mean explains

double normal_quantile(double tail) {
  double low = -10, high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::numbers::sqrt2) / 2 > tail ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// Holds normal quantiles: of a block by itself, of one next to a block that does not match, and of a site (0: none).
struct Thresholds {
  float alone;
  float neighbour;
  float site;
};

Thresholds thresholds_of(double block_false_alarm, double site) {
  const double alone = block_false_alarm / (2 * neighbour_statistics);
  return {static_cast<float>(normal_quantile(alone)), static_cast<float>(normal_quantile(std::cbrt(alone))),
          site > 0 ? static_cast<float>(normal_quantile(site / 2)) : 0};
}

/// Describes the noise of d for one site of the cell: Var = slope max(mu, 0) + offset, and its cumulants per electron.
struct DifferenceNoise {
  float reference_offset;
  float frame_offset;
  float offset;
};

struct Noise {
  std::array<DifferenceNoise, 4> site;
  float reference_slope;  // variance per electron of signal
  float frame_slope;
  float slope;
  float third;   // third cumulant of d per electron of signal
  float fourth;  // fourth cumulant
};

Noise noise_of(const MosaicNoise& reference, const MosaicNoise& frame) {
  Noise out{};
  const double s = reference.fraction, f = frame.fraction;
  for (int i = 0; i < 4; ++i) {
    const double r = s * reference.variance_e2[i], k = f * frame.variance_e2[i];
    out.site[i] = {static_cast<float>(r), static_cast<float>(k), static_cast<float>(r + k)};
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

/// Compares one block; keeps what its sites have in common.
class Block {
 public:
  Block(const Noise& noise, float z_site, float error_px)
      : noise_(noise), z_site_(z_site), error2_px2_(error_px * error_px) {}

  /// @param outliers  counts the sites that become NaN
  Sums compare(PlaneView<const float> reference, PlaneView<float> frame, int x0, int y0, std::int64_t& outliers) {
    const int width = std::min(block_px, frame.width - x0), height = std::min(block_px, frame.height - y0);
    for (int parity = 0; parity < 4; ++parity) measure(reference, frame, {x0, y0, width, height}, parity);
    Sums out;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) add(reference, frame, x0 + x, y0 + y, outliers, out);
    }
    float count = 0, classes = 0;
    for (int i = 0; i < 4; ++i) {
      if (!(out.v[i] > 0)) continue;
      out.spread -= out.d[i] * out.d[i] / out.v[i];
      classes += 1;
    }
    count = out.spread_mean;  // sites counted so far
    out.spread_mean = count - classes;
    if (out.spread_mean < 1) return {};
    out.spread_variance *= out.spread_mean / count;
    return out;
  }

 private:
  struct Area {
    int x, y, width, height;
  };

  /// Finds the mean of both mosaics over one site of the block's cells.
  void measure(PlaneView<const float> reference, PlaneView<float> frame, const Area& area, int site) {
    float r = 0, f = 0, n = 0;
    for (int y = site >> 1; y < area.height; y += 2) {
      const float* const a = reference.row(area.y + y) + area.x;
      const float* const b = frame.row(area.y + y) + area.x;
      for (int x = site & 1; x < area.width; x += 2) {
        const bool valid = a[x] == a[x] && b[x] == b[x];
        r += valid ? a[x] : 0;
        f += valid ? b[x] : 0;
        n += valid ? 1.0F : 0.0F;
      }
    }
    mean_[site] = n > 0 ? combined(r / n, f / n, site, 0) : 0;
  }

  /// Returns the mean of both values, weighted by the inverse of their variances at the signal `level`.
  float combined(float r, float f, int site, float level) const {
    const float vr = noise_.reference_slope * level + noise_.site[site].reference_offset;
    const float vf = noise_.frame_slope * level + noise_.site[site].frame_offset;
    if (!(vr + vf > 0)) return (r * noise_.frame_slope + f * noise_.reference_slope) / noise_.slope;
    return (r * vf + f * vr) / (vr + vf);
  }

  float variance_of_combined(int site, float level) const {
    const float vr = noise_.reference_slope * level + noise_.site[site].reference_offset;
    const float vf = noise_.frame_slope * level + noise_.site[site].frame_offset;
    return vr + vf > 0 ? vr * vf / (vr + vf) : 0;
  }

  /// Returns the variance that an error of the displacement adds: its square times that of the slope, which is the
  /// larger difference to neighbours of the same colour, less what noise explains.
  float detail(PlaneView<const float> reference, int x, int y, float vr) const {
    if (!(error2_px2_ > 0)) return 0;
    const auto across = [&](int dx, int dy) {
      const int u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= reference.width || v >= reference.height) return 0.0F;
      const float d = reference.at(u, v) - reference.at(x, y);
      return d == d ? d * d : 0.0F;
    };
    const float horizontal = std::max(across(-2, 0), across(2, 0)), vertical = std::max(across(0, -2), across(0, 2));
    return error2_px2_ * std::max(horizontal + vertical - 8 * vr, 0.0F) / 4;
  }

  void add(PlaneView<const float> reference, PlaneView<float> frame, int x, int y, std::int64_t& outliers, Sums& out) {
    const float r = reference.at(x, y), f = frame.at(x, y), d = f - r;
    if (!(d == d)) return;
    const int site = site_of(x, y);
    float mu = std::max(mean_[site], 0.0F);
    const float own = combined(r, f, site, mu);
    const float own_variance = variance_of_combined(site, mu);
    mu += std::max(own - mu - unexplained_excess * std::sqrt(own_variance), 0.0F);
    const float vr = noise_.reference_slope * mu + noise_.site[site].reference_offset;
    const float v = noise_.slope * mu + noise_.site[site].offset + detail(reference, x, y, vr);
    if (!(v > 0)) return;
    if (z_site_ > 0 && is_outlier(d, v, mu)) {
      frame.at(x, y) = std::numeric_limits<float>::quiet_NaN();
      ++outliers;
      return;
    }
    const float fourth = noise_.fourth * mu;
    out.d[site] += d;
    out.v[site] += v;
    out.fourth[site] += fourth;
    out.spread += d * d / v;
    out.spread_mean += 1;
    out.spread_variance += 2 + fourth / (v * v);
  }

  bool is_outlier(float d, float v, float mu) const {
    const float sigma = std::sqrt(v), skewness = noise_.third * mu / (v * sigma);
    const float shift = (z_site_ * z_site_ - 1) * skewness / 6;
    return d > (z_site_ + std::max(shift, 0.0F)) * sigma || d < -(z_site_ - std::min(shift, 0.0F)) * sigma;
  }

  const Noise& noise_;
  float z_site_;
  float error2_px2_;
  std::array<float, 4> mean_{};
};

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
    const Thresholds& at = thresholds(x);
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

Comparison compare_mosaics(PlaneView<const float> reference, const MosaicNoise& reference_noise, PlaneView<float> frame,
                           const MosaicNoise& frame_noise, const ComparisonOptions& options, Executor& executor) {
  assert(reference.width == frame.width && reference.height == frame.height);
  const int columns = (frame.width + block_px - 1) / block_px, rows = (frame.height + block_px - 1) / block_px;
  const std::size_t blocks = static_cast<std::size_t>(columns) * rows;
  Grid grid{columns,
            rows,
            std::vector<Sums>(blocks),
            std::vector<float>(blocks),
            std::vector<float>(blocks),
            std::vector<std::uint8_t>(blocks)};
  const SingleFrameBlocks& single = options.single_frame;
  const std::array noise{noise_of(reference_noise, frame_noise), noise_of(single.noise, frame_noise)};
  const std::array at{thresholds_of(options.block_false_alarm, options.site_false_alarm),
                      thresholds_of(single.block_false_alarm, options.site_false_alarm)};
  const auto kind = [&](int x, int y) { return single.is_single.data != nullptr ? single.is_single.at(x, y) : 0; };
  std::vector<std::int64_t> outliers(rows);
  for_each_index(executor, rows, [&](int y) {
    for (int x = 0; x < columns; ++x) {
      Block block(noise[kind(x, y)], at[0].site, static_cast<float>(options.displacement_error_px));
      Sums& sums = grid.sums[grid.at(x, y)];
      sums = block.compare(reference, frame, block_px * x, block_px * y, outliers[y]);
      grid.alone[grid.at(x, y)] = worst_deviate(sums);
    }
  });
  Comparison out{.block_matches = Plane<std::uint8_t>(columns, rows)};
  const auto alone_differs = [&](int x, int y) { return grid.alone[grid.at(x, y)] > at[kind(x, y)].alone; };
  for_each_index(executor, rows, [&](int y) { find_squares(grid, y, alone_differs); });
  for_each_index(executor, rows,
                 [&](int y) { judge(grid, y, [&](int x) -> const Thresholds& { return at[kind(x, y)]; }); });
  for_each_index(executor, rows, [&](int y) {
    for (int x = 0; x < columns; ++x) out.block_matches.at(x, y) = block_matches(grid, x, y) ? 1 : 0;
  });
  summarise(grid, outliers, out);
  return out;
}

}  // namespace lowlux::merge
