#include "denoise/spatial/point_sources.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>

#include "denoise/spatial/local_noise.h"
#include "denoise/spatial/rows.h"

namespace lowlux::denoise {
namespace {

constexpr int ring_windows = 40;  // 14 x 14 sites less 6 x 6, in windows of 4

constexpr int ring_side = 2 * source_margin + 2;  // sites

/// Returns the limit for the sum of the squares of 40 Poisson-like windows over their variance: five standard
/// deviations above its mean.
double max_spread(double variance_e2) { return ring_windows + 5 * std::sqrt(ring_windows * (2 + 1 / variance_e2)); }

struct Search {
  PlaneView<const float> raw;
  double floor_e;      // smallest mean of a window
  double variance_e2;  // variance of a window, in addition to its mean
  NoiseRatioView ratio{};

  double value(int x, int y) const {
    const auto e = static_cast<double>(raw.at(x, y));
    return std::isnan(e) ? 0 : std::clamp(e, -1e9, 1e9);
  }
  double window(int x, int y) const { return value(x, y) + value(x + 1, y) + value(x, y + 1) + value(x + 1, y + 1); }

  double own_ratio(int x, int y) const { return ratio.mean(x, y, 2, 2); }
  double ring_ratio(int x, int y) const {
    return ratio.mean(x - source_margin, y - source_margin, ring_side, ring_side);
  }

  /// Returns whether a window is the largest of the 3 x 3 windows around; of equal ones, the first is.
  bool is_peak(int x, int y, double own) const {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const double other = window(x + i, y + j);
        const bool before = j < 0 || (j == 0 && i < 0);
        if (other > own || (before && other == own)) return false;
      }
    }
    return true;
  }

  struct Surroundings {
    double mean = 0;               // mean of the windows
    double spread = 0;             // sum of squared deviations from the mean
    std::array<double, 4> site{};  // mean of each site of a window
  };
  Surroundings around(int x, int y) const {
    Surroundings out;
    std::array<double, ring_windows> sum{};
    int count = 0;
    for (int j = -6; j <= 6; j += 2) {
      for (int i = -6; i <= 6; i += 2) {
        if (std::max(std::abs(i), std::abs(j)) <= 2) continue;
        sum[count++] = window(x + i, y + j);
        for (int s = 0; s < 4; ++s) out.site[s] += value(x + i + s % 2, y + j + s / 2) / ring_windows;
      }
    }
    for (const double s : sum) out.mean += s / ring_windows;
    for (const double s : sum) out.spread += (s - out.mean) * (s - out.mean);
    return out;
  }

  bool is_source(int x, int y) const {
    const double own = window(x, y);
    if (!is_peak(x, y, own)) return false;
    const Surroundings s = around(x, y);
    const double one = std::max(s.mean, floor_e) + variance_e2;
    const double r = own_ratio(x, y), of_ring = ring_ratio(x, y);
    const double variance = one * (r + of_ring / ring_windows), excess = own - s.mean, u = r * excess / variance;
    if (!(excess > 0) || variance / (r * r) * ((1 + u) * std::log1p(u) - u) < min_significance) return false;
    if (s.spread / (of_ring * one) > max_spread(one / of_ring)) return false;
    double brightest = value(x, y) - s.site[0];
    for (int i = 1; i < 4; ++i) brightest = std::max(brightest, value(x + i % 2, y + i / 2) - s.site[i]);
    return excess - brightest > 2.5 * std::sqrt(0.75 * variance);
  }
};

/// Marks the cells of rows first .. last - 1, from all windows that reach into them.
struct Band {
  const Search& search;
  const SearchMemory& memory;
  PlaneView<std::uint8_t> cells;

  void mark(int x, int y, int first, int last) const {
    for (int j = std::max(first, (y - 1) / 2); j <= std::min(last - 1, (y + 2) / 2); ++j) {
      for (int i = (x - 1) / 2; i <= (x + 2) / 2; ++i) cells.at(i, j) = 1;
    }
  }

  /// Returns a necessary condition of is_source, in single precision: the surroundings are not clearly more uneven than
  /// noise.
  bool may_be_alone(const rows::WindowRow& in, int x, int y) const {
    std::array<float, ring_windows> windows{};
    double mean = 0, spread = 0;
    int count = 0;
    for (int j = 0; j < 7; ++j) {
      for (int i = -6; i <= 6; i += 2) {
        if (std::abs(i) <= 2 && j >= 2 && j <= 4) continue;
        windows[static_cast<std::size_t>(count++)] = in.pair[j][x + i] + in.pair[j][x + i + 1];
      }
    }
    for (const float w : windows) mean += static_cast<double>(w) / ring_windows;
    for (const float w : windows) spread += (w - mean) * (w - mean);
    const double one = std::max(mean, search.floor_e) + search.variance_e2, ratio = search.ring_ratio(x, y);
    return spread / (ratio * one) <= 1.001 * max_spread(one / ratio) + 1;
  }

  /// Returns the noise ratio of the windows of row y without that of their rings, of which WindowRow includes 1/40;
  /// null where it is 1. The memory keeps it for later rows of the same blocks.
  const float* ratio_row(int y, bool first) const {
    if (search.ratio.is_one()) return nullptr;
    if (first || !same_blocks(search.ratio, y - 1, y)) {
      const std::span<float> row{memory.ratio, static_cast<std::size_t>(search.raw.width)};
      ratio_of_windows(search.ratio, y, row);
      for (float& ratio : row) ratio *= 1 / 1.025f;
    }
    return memory.ratio;
  }

  void run(int first, int last) const {
    const int width = search.raw.width, height = search.raw.height;
    for (int y = first; y < last; ++y) std::memset(cells.row(y), 0, static_cast<std::size_t>(cells.width));
    const int top = std::max(source_margin, 2 * first - 2);
    const int bottom = std::min(height - 2 - source_margin, 2 * last);
    if (width < 2 * source_margin + 2 || top > bottom) return;
    const auto slot = [](int y) { return static_cast<std::size_t>(y % 14); };
    int paired = top - source_margin;
    for (int y = top; y <= bottom; ++y) {
      for (; paired <= y + source_margin; ++paired) {
        rows::pair_row(search.raw.row(paired), search.raw.row(paired + 1), width, memory.pair[slot(paired)]);
      }
      rows::WindowRow in{};
      for (int j = 0; j < 7; ++j) in.pair[j] = memory.pair[slot(y - 6 + 2 * j)];
      in.above = memory.pair[slot(y - 1)];
      in.below = memory.pair[slot(y + 1)];
      in.first = source_margin;
      in.last = width - 1 - source_margin;
      in.floor_e = static_cast<float>(search.floor_e);
      in.variance_e2 = static_cast<float>(search.variance_e2);
      in.inner = memory.sums[0];
      in.outer = memory.sums[1];
      in.significance = static_cast<float>(0.999 * min_significance);  // for rounding: is_source decides in double
      in.ratio = ratio_row(y, y == top);
      const int found = rows::bright_windows(in, memory.found);
      for (int i = 0; i < found; ++i) {
        if (may_be_alone(in, memory.found[i], y) && search.is_source(memory.found[i], y))
          mark(memory.found[i], y, first, last);
      }
    }
  }
};

}  // namespace

void find_point_sources(const RawElectronsView& raw, const RawNoise& noise, const Workers& workers,
                        const SearchMemory* memory, PlaneView<std::uint8_t> cells) {
  double floor_e = 0;
  for (const double dark : noise.dark_mean_e) floor_e += 0.3 * dark + 0.02;
  const Search search{raw.value, floor_e, noise.variance_e2[0] + 2 * noise.variance_e2[1] + noise.variance_e2[2],
                      raw.noise_ratio};
  in_bands(workers, cells.height, [&](int first, int last, int thread) {
    const ScratchUse use(memory[thread].scratch);
    Band{search, memory[thread], cells}.run(first, last);
  });
}

double background_e(const RawElectronsView& raw, PlaneView<const std::uint8_t> cells, int x, int y) {
  const Search search{raw.value, 0, 0};
  double sum = 0;
  int count = 0;
  for (int j = y - 6; j <= y + 6; j += 2) {
    for (int i = x - 6; i <= x + 6; i += 2) {
      if (i < 0 || j < 0 || i >= raw.value.width || j >= raw.value.height || cells.at(i / 2, j / 2) != 0) continue;
      sum += search.value(i, j);
      ++count;
    }
  }
  return count == 0 ? search.value(x, y) : sum / count;
}

}  // namespace lowlux::denoise
