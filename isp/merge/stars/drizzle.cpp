#include "isp/merge/stars/drizzle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "isp/merge/inverse_motion.h"
#include "isp/merge/stars/background.h"

namespace lowlux::merge {
namespace {

constexpr int band_rows = 256;        // output rows of one task
constexpr double rounding_px = 1e-4;  // of the side of a drop: what is beyond the last pixel counts as in it
constexpr double max_area = 2.25;     // of a pixel of the frame in pixels of the reference
constexpr double min_area = 0.25;

int output_side(int side, double scale) { return static_cast<int>(std::ceil(side * scale - 1e-9)); }

bool is_accepted(const AcceptedBlocks& accepted, int x, int y) {
  if (accepted.blocks.data == nullptr) return true;
  const int i = std::clamp(x / accepted.block_px, 0, accepted.blocks.width - 1);
  const int j = std::clamp(y / accepted.block_px, 0, accepted.blocks.height - 1);
  return accepted.blocks.at(i, j) != 0;
}

/// A drop in output pixels.
struct DropSize {
  float side;
  float per_side;
  float sliver;    // a smaller part is rounding, or its square would underflow
  float per_area;  // 1 / area of a pixel of the frame in pixels of the reference

  DropSize(double side_px, double area)
      : side(static_cast<float>(side_px)),
        per_side(1 / side),
        sliver(1e-6F * side),
        per_area(static_cast<float>(1 / area)) {}
};

/// Rounds down; std::floor is a call on processors of the baseline. Precondition: x > -65536.
int floor_of(double x) { return static_cast<int>(x + 65536) - 65536; }

/// The parts of a drop in N output pixels along one axis. They add up to 1 but for rounding.
template <int kPixels>
struct Cover {
  int first;
  std::array<float, kPixels> part;

  /// @param low  lower edge of the drop, where output pixel k reaches from k to k + 1
  Cover(double low, const DropSize& size) : first(floor_of(low)) {
    float from = static_cast<float>(low - first), left = size.side;
    for (std::size_t k = 0; k < kPixels; ++k) {
      const float overlap = k + 1 == kPixels ? left : std::min(1 - from, left);
      const bool is_sliver = overlap < size.sliver;  // what is before the next pixel counts as in it
      part[k] = is_sliver ? 0.0F : overlap * size.per_side;
      left -= is_sliver ? 0.0F : overlap;
      from = 0;
    }
  }
};

/// Writes values, weights and variances of a row of sums. Returns the number of pixels without data.
std::int64_t finish_row(const float* sums, int width, float steady_variance_e2, float* out) {
  std::int64_t empty = 0;
  for (int x = 0; x < width; ++x, sums += 3) {
    const float weight = sums[1], per_weight = weight > 0 ? 1 / weight : 0.0F, value = sums[0] * per_weight;
    out[x] = value;
    out[width + x] = weight;
    out[2 * width + x] = sums[2] * per_weight * per_weight * (std::max(value, 0.0F) + steady_variance_e2);
    empty += weight > 0 ? 0 : 1;
  }
  return empty;
}

/// Places of one row of a cell of the frame in the output: linear in the column.
struct RowPlaces {
  Point first;
  Point step;
};

}  // namespace

/// Adds one frame to one band of output rows.
struct Drizzle::Target {
  const DrizzleFrame& frame;
  const InverseMotion& inverse;
  std::array<Plane<float>, 3>& sums;
  int width;  // width of the output
  DrizzleOptions options;
  PerSite<float> weight;
  RowBand band;
  DrizzleCounts counts{};

  Point output_place(const Point& reference) const {
    return {(reference.x + 0.5) * options.scale, (reference.y + 0.5) * options.scale};  // pixel edges are integers
  }

  void run() {
    for (int row = 0; row < inverse.rows; ++row) {
      for (int column = 0; column < inverse.columns; ++column) add_cell(column, row);
    }
  }

  bool is_in_view(const std::array<Point, 4>& corners, double side) const {
    double left = corners[0].x, right = left, top = corners[0].y, bottom = top;
    for (const Point& corner : corners) {
      if (!std::isfinite(corner.x) || !std::isfinite(corner.y)) return false;
      left = std::min(left, corner.x);
      right = std::max(right, corner.x);
      top = std::min(top, corner.y);
      bottom = std::max(bottom, corner.y);
    }
    return right + side >= 0 && left - side <= width && bottom + side >= band.first && top - side <= band.last;
  }

  void add_cell(int column, int row) {
    constexpr int cell = InverseMotion::cell_px;
    const std::array<Point, 4> corners{
        output_place(inverse.node(column, row)), output_place(inverse.node(column + 1, row)),
        output_place(inverse.node(column, row + 1)), output_place(inverse.node(column + 1, row + 1))};
    const double area = inverse.area[static_cast<std::size_t>(row) * static_cast<std::size_t>(inverse.columns) +
                                     static_cast<std::size_t>(column)];
    if (!(area >= min_area && area <= max_area)) return;  // also if there is no inverse
    const double side = options.pixfrac * options.scale * std::sqrt(area);
    if (!is_in_view(corners, side)) return;
    const int last = std::min((row + 1) * cell, frame.frame.signal_e.height);
    for (int y = row * cell; y < last; ++y) {
      const double v = static_cast<double>(y - row * cell) / cell;
      const auto mixed = [&](const Point& a, const Point& b) {
        return Point{a.x + v * (b.x - a.x), a.y + v * (b.y - a.y)};
      };
      const Point begin = mixed(corners[0], corners[2]), end = mixed(corners[1], corners[3]);
      const RowPlaces places{begin, {(end.x - begin.x) / cell, (end.y - begin.y) / cell}};
      const DropSize size(side, area);
      switch (static_cast<int>(std::ceil(side - rounding_px))) {
        case 0:
        case 1:
          add_row<2>(column * cell, y, places, size);
          break;
        case 2:
          add_row<3>(column * cell, y, places, size);
          break;
        case 3:
          add_row<4>(column * cell, y, places, size);
          break;
        default:
          add_row<6>(column * cell, y, places, size);
          break;
      }
    }
  }

  bool is_rejected(const Point& place) const {
    return !is_accepted(frame.accepted, static_cast<int>(place.x / options.scale),
                        static_cast<int>(place.y / options.scale));
  }

  template <int kPixels>
  void add_row(int x0, int y, const RowPlaces& places, const DropSize& size) {
    const float* const row = frame.frame.signal_e.row(y);
    const int last = std::min(x0 + InverseMotion::cell_px, frame.frame.signal_e.width);
    const double half = static_cast<double>(size.side) / 2;
    for (int x = x0; x < last; ++x) {
      const Point place{places.first.x + (x - x0) * places.step.x, places.first.y + (x - x0) * places.step.y};
      if (std::isnan(row[x]) || place.y + half < band.first || place.y - half > band.last) continue;
      const bool own = place.y >= band.first && place.y < band.last && place.x >= 0 && place.x < width;
      if (is_rejected(place)) {
        counts.rejected += own ? 1 : 0;
        continue;
      }
      counts.used += own ? 1 : 0;
      const Cover<kPixels> h(place.x - half, size), v(place.y - half, size);
      float* const sum = sums[static_cast<std::size_t>(colour_at(frame.frame.phase, x, y))].data();
      const float w = weight[static_cast<std::size_t>(site_of(x, y))];
      const bool inside =
          h.first >= 0 && h.first + kPixels <= width && v.first >= band.first && v.first + kPixels <= band.last;
      if (inside) {
        add_drop<kPixels>(sum, h, v, {w, row[x] * size.per_area, size.per_area});
      } else {
        add_drop_within(sum, h, v, {w, row[x] * size.per_area, size.per_area});
      }
    }
  }

  struct Sample {
    float weight;
    float value;
    float per_area;
  };

  /// Adds a drop whose output pixels all exist. Those that it does not cover get 0: adding it is faster than a branch.
  template <int kPixels>
  void add_drop(float* sum, const Cover<kPixels>& h, const Cover<kPixels>& v, const Sample& sample) const {
    float* pixel = sum + 3 * (static_cast<std::ptrdiff_t>(v.first) * width + h.first);
    for (int j = 0; j < kPixels; ++j, pixel += 3 * static_cast<std::ptrdiff_t>(width)) {
      const float part = sample.weight * v.part[static_cast<std::size_t>(j)];
      for (int i = 0; i < kPixels; ++i) add_part(pixel + 3 * i, part * h.part[static_cast<std::size_t>(i)], sample);
    }
  }

  /// Adds the parts of a drop whose output pixels exist and are of this band.
  template <int kPixels>
  void add_drop_within(float* sum, const Cover<kPixels>& h, const Cover<kPixels>& v, const Sample& sample) const {
    for (int j = 0; j < kPixels; ++j) {
      for (int i = 0; i < kPixels; ++i) {
        const int x = h.first + i, y = v.first + j;
        if (x < 0 || x >= width || y < band.first || y >= band.last) continue;
        const float part = sample.weight * v.part[static_cast<std::size_t>(j)] * h.part[static_cast<std::size_t>(i)];
        add_part(sum + 3 * (static_cast<std::ptrdiff_t>(y) * width + x), part, sample);
      }
    }
  }

  static void add_part(float* pixel, float part, const Sample& sample) {
    const float scaled = part * sample.per_area;
    pixel[0] += part * sample.value;
    pixel[1] += part;
    pixel[2] += scaled * scaled;
  }
};

Drizzle::Drizzle(int width, int height, const DrizzleOptions& options)
    : options_(options), width_(output_side(width, options.scale)), height_(output_side(height, options.scale)) {
  assert(width >= 1 && height >= 1);
  assert(options.scale >= 1 && options.scale <= 3 && options.pixfrac >= 0.05 && options.pixfrac <= 1);
  for (Plane<float>& sums : sums_) {
    sums = Plane<float>(3 * width_, height_);
    std::fill_n(sums.data(), sums.size(), 0.0F);
  }
}

DrizzleCounts Drizzle::add(const DrizzleFrame& frame, Executor& executor) {
  PerSite<float> weight{};
  for (std::size_t s = 0; s < 4; ++s) {
    const double variance = std::max(frame.level_e[s], 0.0) + frame.frame.variance_e2[s];
    const double w = 1 / std::max(variance, min_variance_e2);
    const auto c =
        static_cast<std::size_t>(colour_at(frame.frame.phase, static_cast<int>(s % 2), static_cast<int>(s / 2)));
    weight[s] = static_cast<float>(w);
    variance_sum_e2_[c] += w * w * frame.frame.variance_e2[s];
    variance_weight_[c] += w * w;
  }
  const InverseMotion inverse = inverse_of(frame.motion, frame.frame.signal_e.width, frame.frame.signal_e.height);
  const int bands = (height_ + band_rows - 1) / band_rows;
  std::vector<DrizzleCounts> counts(static_cast<std::size_t>(bands));
  for_each_index(executor, bands, [&](int index) {
    const RowBand band{index * band_rows, std::min((index + 1) * band_rows, height_)};
    Target target{frame, inverse, sums_, width_, options_, weight, band};
    target.run();
    counts[static_cast<std::size_t>(index)] = target.counts;
  });
  DrizzleCounts total;
  for (const DrizzleCounts& count : counts) {
    total.used += count.used;
    total.rejected += count.rejected;
  }
  return total;
}

DrizzleImage Drizzle::finish(Executor& executor) {
  DrizzleImage out{.width = width_, .height = height_};
  for (std::size_t c = 0; c < 3; ++c) {
    const double weight = variance_weight_[c];
    const auto steady = static_cast<float>(weight > 0 ? variance_sum_e2_[c] / weight : 0);
    std::vector<std::int64_t> empty(static_cast<std::size_t>(executor.width()));
    for_each_band(executor, height_, [&](RowBand band, int index) {
      std::vector<float> row(3 * static_cast<std::size_t>(width_));
      for (int y = band.first; y < band.last; ++y) {
        std::copy_n(sums_[c].row(y), row.size(), row.begin());
        empty[static_cast<std::size_t>(index)] += finish_row(row.data(), width_, steady, sums_[c].row(y));
      }
    });
    const std::int64_t pixels = std::accumulate(empty.begin(), empty.end(), std::int64_t{0});
    out.empty_fraction[c] = static_cast<double>(pixels) / (static_cast<double>(width_) * height_);
    out.rows[c] = std::move(sums_[c]);
  }
  return out;
}

std::int64_t Drizzle::memory_bytes(int width, int height, const DrizzleOptions& options) {
  constexpr std::int64_t planes = 9;
  return planes * static_cast<std::int64_t>(sizeof(float)) * output_side(width, options.scale) *
         output_side(height, options.scale);
}

double noise_correlation_ratio(const DrizzleOptions& options) {
  const double r = options.pixfrac * options.scale;
  return r >= 1 ? r / (1 - 1 / (3 * r)) : 1 / (1 - r / 3);
}

}  // namespace lowlux::merge
