#include "denoise/spatial/area_means.h"

#include <cmath>
#include <cstddef>
#include <span>

#include "denoise/spatial/chroma_start.h"
#include "isp/base/frame.h"

namespace lowlux::denoise {
namespace {

/// Mean over all places of the variance of the interpolated means, over the variance of a mean over a square. Along one
/// axis the power of the nodes is 1 / (3/4 + cos(w) / 4)^2 and that of the interpolation 2/3 + cos(w) / 3; their mean
/// over w is (2 a - b) / (3 (a^2 - b^2)^1.5) = 1.179 for a = 3/4, b = 1/4.
constexpr double interpolated_variance = 1.39;

constexpr double max_variance = 8;  // of a site that counts, over the harmonic mean of its square
constexpr double max_sigma = 5;     // of a difference that is noise

/// Sums over the sites of one colour in a square.
struct SiteSums {
  double inverse_variance = 0;
  int seen = 0;  // number of all of them, whether they count or not
  double missing_e = 0;
  double variance_e2 = 0;
  int counted = 0;
  int all = 0;
};

/// Factors of the elimination (Thomas) of before + 6 own + after in find_nodes, each 1 / (6 - the one before). They
/// converge to 3 - sqrt 8, by a factor of 0.03 from each to the next.
constexpr std::size_t converged = 12;
constexpr std::array<double, converged> factors() {
  std::array<double, converged> out{1.0 / 7};
  for (std::size_t i = 1; i < converged; ++i) out[i] = 1 / (6 - out[i - 1]);
  return out;
}

/// Replaces means over squares along one axis by the values at their centres between which linear interpolation,
/// constant beyond the first and last, has these means. The mean of a square is (before + 6 own + after) / 8; that of
/// the last one, of `last_cells`, is (before (s / 8) + own (last_cells - s / 8)) / last_cells for squares of s cells.
void find_nodes(float* values, std::ptrdiff_t stride, int count, int last_cells) {
  if (count == 1) return;
  constexpr std::array<double, converged> factor = factors();
  const auto factor_at = [&](int i) { return factor[std::min(static_cast<std::size_t>(i), converged - 1)]; };
  const auto at = [&](int i) -> float& { return values[i * stride]; };
  double before = 8.0 / 7 * static_cast<double>(at(0));
  at(0) = static_cast<float>(before);
  for (int i = 1; i + 1 < count; ++i) {
    before = (8 * static_cast<double>(at(i)) - before) * factor_at(i);
    at(i) = static_cast<float>(before);
  }
  const double of_before = mean_square / 8.0 / last_cells;
  const int last = count - 1;
  double after =
      (static_cast<double>(at(last)) - of_before * before) / (1 - of_before - of_before * factor_at(last - 1));
  at(last) = static_cast<float>(after);
  for (int i = last - 1; i >= 0; --i) {
    after = static_cast<double>(at(i)) - factor_at(i) * after;
    at(i) = static_cast<float>(after);
  }
}

/// State of one call of restore_means.
struct Restoring {
  const MeansFrame& frame;
  FrameMemory& memory;
  PlaneView<float> signal_e;
  int columns;  // cells
  int rows;
  int across;  // squares
  int down;

  std::size_t squares() const { return static_cast<std::size_t>(across) * static_cast<std::size_t>(down); }
  std::span<float> mean(std::size_t k) const { return std::span(memory.means).subspan(k * squares(), squares()); }
  std::span<float> variance(std::size_t k) const { return mean(3 + k); }
  std::size_t colour(int x, int y) const { return static_cast<std::size_t>(colour_at(frame.raw.phase, x, y)); }
  int end(int i, int count, int cells) const { return i + 1 == count ? cells : (i + 1) * mean_square; }

  /// Calls use(k, missing_e, variance_e2) for the sites of a square of cells that are not saturated and no point
  /// source, and skip(k) for the others: the colour, what the result lacks, and the variance of the larger of both
  /// values.
  template <class Use, class Skip>
  void for_sites(const Rect& square, const Use& use, const Skip& skip) const {
    for (int y = square.y; y < square.y + square.height; ++y) {
      const float *const raw = frame.raw.value.row(y), *const signal = signal_e.row(y);
      const std::uint8_t* const saturated = frame.saturated.row(y / 2);
      const std::uint8_t* const source = frame.sources.data == nullptr ? nullptr : frame.sources.row(y / 2);
      for (int x = square.x; x < square.x + square.width; ++x) {
        const std::size_t k = colour(x, y);
        if (std::isnan(raw[x]) || saturated[x / 2] != 0 || (source != nullptr && source[x / 2] != 0)) {
          skip(k);
          continue;
        }
        const double value = std::clamp(static_cast<double>(raw[x]), -largest_e, largest_e);
        const double result = frame.dark_e[k] + static_cast<double>(signal[x]);
        const double larger = std::max({value, result, static_cast<double>(frame.min_e[k])});
        use(k, value - result, larger + frame.noise.variance_e2[k]);
      }
    }
  }

  /// Measures what is missing in the mean of a square, and the variance of the mean.
  void measure(int square_x, int square_y) const {
    const int left = 2 * mean_square * square_x, top = 2 * mean_square * square_y;
    const int right = std::min(2 * end(square_x, across, columns), signal_e.width);
    const int bottom = std::min(2 * end(square_y, down, rows), signal_e.height);
    const Rect square{left, top, right - left, bottom - top};
    const double ratio =
        frame.variance_scale * frame.raw.noise_ratio.mean(square.x, square.y, square.width, square.height);
    std::array<SiteSums, 3> sums{};
    for_sites(
        square,
        [&](std::size_t k, double, double variance_e2) {
          sums[k].inverse_variance += 1 / variance_e2;
          ++sums[k].seen;
          ++sums[k].all;
        },
        [&](std::size_t k) { ++sums[k].all; });
    for_sites(
        square,
        [&](std::size_t k, double missing_e, double variance_e2) {
          SiteSums& sum = sums[k];
          const bool is_lamp = variance_e2 * sum.inverse_variance > max_variance * sum.seen;
          if (is_lamp || missing_e * missing_e > max_sigma * max_sigma * ratio * variance_e2) return;
          sum.missing_e += missing_e;
          sum.variance_e2 += variance_e2;
          ++sum.counted;
        },
        [](std::size_t) {});
    const std::size_t i = static_cast<std::size_t>(square_y) * static_cast<std::size_t>(across) + square_x;
    for (std::size_t k = 0; k < 3; ++k) {
      const double sites = std::max({static_cast<double>(sums[k].counted), 0.25 * sums[k].all, 1.0});
      mean(k)[i] = static_cast<float>(sums[k].missing_e / sites);
      variance(k)[i] = static_cast<float>(interpolated_variance * ratio * sums[k].variance_e2 / (sites * sites));
    }
  }

  void find_all_nodes() const {
    const int last_columns = columns - (across - 1) * mean_square, last_rows = rows - (down - 1) * mean_square;
    for (std::size_t k = 0; k < 3; ++k) {
      float* const values = mean(k).data();
      for (int y = 0; y < down; ++y)
        find_nodes(values + static_cast<std::ptrdiff_t>(y) * across, 1, across, last_columns);
      for (int x = 0; x < across; ++x) find_nodes(values + x, across, down, last_rows);
    }
  }

  std::span<float> between(std::span<const float> squares, int y, float* out) const {
    const std::span<float> row(out, static_cast<std::size_t>(columns));
    interpolate_row(squares, across, down, mean_grid, y, row);
    return row;
  }

  /// Adds the means to the raw rows of a row of cells.
  void add_means(int cell_y, const MeansMemory& m) const {
    for (std::size_t k = 0; k < 3; ++k) between(mean(k), cell_y, m.row[k]);
    const std::uint8_t* const saturated = frame.saturated.row(cell_y);
    for (int y = 2 * cell_y; y < std::min(2 * cell_y + 2, signal_e.height); ++y) {
      float* const out = signal_e.row(y);
      for (int first = 0; first < 2; ++first) {
        const float* const added = m.row[colour(first, y)];
        for (int x = first; x < signal_e.width; x += 2) out[x] += saturated[x / 2] != 0 ? 0.0f : added[x / 2];
      }
    }
  }

  void add_variances(int cell_y, const DenoiseMaps& maps, const MeansMemory& m) const {
    const std::uint8_t* const saturated = frame.saturated.row(cell_y);
    const auto add = [&](PlaneView<float> map, std::span<const float> added, float weight) {
      if (map.data == nullptr) return;
      float* const out = map.row(cell_y);
      for (std::size_t x = 0; x < added.size(); ++x) out[x] += saturated[x] != 0 ? 0.0f : weight * added[x];
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const std::span<const float> added = between(variance(k), cell_y, m.row[k]);
      const double of_luma = (k == 1 ? 0.6 : 0.2) * frame.white_gain[k];
      add(maps.site_variance[k], added, 1);
      add(maps.residual_variance, added, static_cast<float>(of_luma * of_luma));
    }
  }
};

}  // namespace

void restore_means(const MeansFrame& frame, FrameMemory& memory, const Workers& workers, PlaneView<float> signal_e,
                   const DenoiseMaps& maps) {
  const int columns = (signal_e.width + 1) / 2, rows = (signal_e.height + 1) / 2;
  const Restoring run{frame, memory, signal_e, columns, rows, squares_of(columns), squares_of(rows)};
  in_bands(workers, run.down, [&](int first, int last, int) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < run.across; ++x) run.measure(x, y);
    }
  });
  run.find_all_nodes();
  in_bands(workers, rows, [&](int first, int last, int thread) {
    const MeansMemory& m = memory.thread[static_cast<std::size_t>(thread)].means;
    const ScratchUse use(m.scratch);
    for (int y = first; y < last; ++y) {
      run.add_means(y, m);
      run.add_variances(y, maps, m);
    }
  });
}

}  // namespace lowlux::denoise
