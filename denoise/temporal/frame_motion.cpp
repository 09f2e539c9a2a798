#include "denoise/temporal/frame_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace lowlux::denoise {
namespace {

using rows::block_cells;
using rows::motion_block;
using rows::tile_cells;

constexpr int tile_blocks = tile_cells / block_cells;
constexpr int coarse = 4;               // cells of a coarse cell, each way
constexpr int reach = 8;                // of the search of the whole frame [coarse cells], 64 sites
constexpr int tile_steps = 2;           // by one cell, from the displacement that a tile begins with
constexpr int min_sampled_height = 64;  // in cells, from which on a quarter of the rows determine a displacement
constexpr double noise2 = rows::units_per_sigma * rows::units_per_sigma;  // variance of the frame's cells [units^2]
constexpr double frame_significance = 4;  // standard deviations by which a displacement is better than none
constexpr double significance = 2;        // and better than another one, for a tile or block
constexpr double max_residual_cells = 0.5;
/// Squared ratio of the change by an error of a displacement at a site to that in the mean of a cell. Chosen on
/// kodim05, kodim15, kodim19 and kodim23.
constexpr double mismatch_of_sites = 1.5;
constexpr double min_displaced = 1.0 / 32;  // part of the tiles, from which on motion counts as found
constexpr double min_mismatch = 0.01;       // and mean relative variance
constexpr double never = std::numeric_limits<double>::infinity();

using Displacement = FrameMotion::Displacement;

int tile_count(int sites) { return (sites + FrameMotion::tile - 1) / FrameMotion::tile; }

/// Two planes of stabilised cells, of which width x height are known.
struct Cells {
  const Plane<std::int16_t>& frame;
  const Plane<std::int16_t>& mean;
  int width;
  int height;

  /// Returns the mean squared difference [units^2] of a rectangle of the frame to the displaced mean, where that lies
  /// inside; infinity if less than half of it does.
  /// @param step  distance of the rows that are compared
  double cost(const Rect& part, Displacement by, int step = 1) const {
    const int left = std::max(part.x, -by.x), right = std::min(part.x + part.width, width - std::max(by.x, 0));
    const int top = std::max(part.y, -by.y), bottom = std::min(part.y + part.height, height - std::max(by.y, 0));
    if (left >= right || top >= bottom) return never;
    if (2LL * (right - left) * (bottom - top) < static_cast<long long>(part.width) * part.height) return never;
    const int lines = (bottom - top + step - 1) / step;
    const auto sum = rows::squared_difference({frame.row(top) + left, std::ptrdiff_t{step} * frame.width(),
                                               mean.row(top + by.y) + left + by.x, std::ptrdiff_t{step} * mean.width()},
                                              right - left, lines);
    return static_cast<double>(sum) / (static_cast<double>(right - left) * lines);
  }
};

/// Returns the standard deviation of the difference of two costs of n cells where there is only noise.
double deviation(double share, double n) { return 2 * noise2 * (1 + share) / std::sqrt(n); }

double capped(float share) { return std::min(1.0, static_cast<double>(share)); }

/// Returns the noise of the sum over a block of the squares of slopes along one axis [units^2].
double slope_noise(float share) { return 2 * noise2 * block_cells * block_cells * capped(share); }

void sum_coarse_cells(const Plane<std::int16_t>& cells, int y, int width, std::int16_t* out) {
  for (int x = 0; x < width; ++x) {
    int sum = 0;
    for (int v = 0; v < coarse; ++v) {
      const std::int16_t* const row = cells.row(coarse * y + v) + coarse * x;
      for (int u = 0; u < coarse; ++u) sum += row[u];
    }
    out[x] = static_cast<std::int16_t>(sum / coarse);
  }
}

}  // namespace

/// One search. The steps follow each other; those of tiles are independent of each other.
class FrameMotion::Search {
 public:
  Search(FrameMotion& own, const Before& before, int width, int height, PlaneView<float> share)
      : own_(own),
        before_(before),
        share_(share),
        width_(width),
        height_(height),
        fine_{own.frame_, own.mean_, width / 2, height / 2},
        coarse_{own.coarse_frame_, own.coarse_mean_, fine_.width / coarse, fine_.height / coarse} {}

  void stabilise(const RawElectronsView& raw, const rows::SiteNoise& noise, const Workers& workers) const;
  Displacement of_frame(const Workers& workers) const;
  void displace_tile(int tile_x, int tile_y, Displacement of_frame) const;
  void displace_blocks(int tile_x, int tile_y) const;
  void add_mismatch(int tile_x, int tile_y) const;

 private:
  /// Returns the blocks of a tile that the frame has.
  Rect blocks_of(int tile_x, int tile_y) const {
    const int x = tile_blocks * tile_x, y = tile_blocks * tile_y;
    return {x, y, std::min(tile_blocks, share_.width - x), std::min(tile_blocks, share_.height - y)};
  }
  /// Returns the cells of a square of `side` that the frame has; it may have none.
  Rect cells_of(int x, int y, int side) const {
    return {x, y, std::min(side, fine_.width - x), std::min(side, fine_.height - y)};
  }
  template <class Work>
  void each_neighbour(int tile_x, int tile_y, const Work& work) const {
    for (int y = std::max(tile_y - 1, 0); y <= std::min(tile_y + 1, tile_count(height_) - 1); ++y) {
      for (int x = std::max(tile_x - 1, 0); x <= std::min(tile_x + 1, tile_count(width_) - 1); ++x) work(x, y);
    }
  }
  double mean_fraction(const Rect& blocks) const;
  float displaced_share(int block_x, int block_y, Displacement by) const;
  bool has_slopes(int block_x, int block_y) const;
  void measure_slopes(const Rect& blocks) const;
  Residual fit(int tile_x, int tile_y) const;

  FrameMotion& own_;
  const Before& before_;
  PlaneView<float> share_;
  int width_;
  int height_;
  Cells fine_;
  Cells coarse_;
};

void FrameMotion::Search::stabilise(const RawElectronsView& raw, const rows::SiteNoise& noise,
                                    const Workers& workers) const {
  rows::StabiliseRow of_frame{}, of_mean{};
  of_frame.cells = of_mean.cells = fine_.width;
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<std::size_t>(colour_at(raw.phase, site % 2, site / 2));
    of_frame.dark_e[site] = noise.dark_e[colour];
    of_frame.offset_e2 += std::max(noise.dark_e[colour] + noise.variance_e2[colour], noise.min_e2[colour]);
  }
  of_mean.offset_e2 = of_frame.offset_e2;
  in_bands(workers, (fine_.height + coarse - 1) / coarse, [&](int first, int last, int) {
    for (int y = coarse * first; y < std::min(coarse * last, fine_.height); ++y) {
      rows::StabiliseRow frame = of_frame, mean = of_mean;
      frame.upper = raw.value.row(2 * y);
      frame.lower = raw.value.row(2 * y + 1);
      mean.upper = before_.mean_e.row(2 * y);
      mean.lower = before_.mean_e.row(2 * y + 1);
      rows::stabilise_row(frame, own_.frame_.row(y));
      rows::stabilise_row(mean, own_.mean_.row(y));
      if (y % coarse != coarse - 1) continue;
      sum_coarse_cells(own_.frame_, y / coarse, coarse_.width, own_.coarse_frame_.row(y / coarse));
      sum_coarse_cells(own_.mean_, y / coarse, coarse_.width, own_.coarse_mean_.row(y / coarse));
    }
  });
}

/// Returns the displacement of most of the frame [cells]; none where that is not significantly better.
Displacement FrameMotion::Search::of_frame(const Workers& workers) const {
  const Rect all{0, 0, coarse_.width, coarse_.height};
  const int reach_x = std::min(reach, all.width / 2), reach_y = std::min(reach, all.height / 2);
  const int columns = 2 * reach_x + 1, count = columns * (2 * reach_y + 1), still = count / 2;
  const auto at = [&](int i) { return Displacement{i % columns - reach_x, i / columns - reach_y}; };
  for_each_index(workers.executor, count, [&](int i) { own_.cost_[i] = coarse_.cost(all, at(i)); });
  const auto square = [&](int i) { return at(i).x * at(i).x + at(i).y * at(i).y; };
  int best = still;
  for (int i = 0; i < count; ++i) {
    const double less = own_.cost_[best] - own_.cost_[i];
    if (less > 0 || (less == 0 && square(i) < square(best))) best = i;
  }
  const double of_coarse = deviation(1, static_cast<double>(all.width) * all.height);
  if (own_.cost_[best] > own_.cost_[still] - frame_significance * of_coarse) best = still;

  const Rect cells{0, 0, fine_.width, fine_.height};
  const int step = fine_.height >= min_sampled_height ? 4 : 1;
  Displacement by{coarse * at(best).x, coarse * at(best).y};
  for (const int stride : {2, 1}) {
    const auto neighbour = [&](int i) {
      return Displacement{by.x + stride * (i % 3 - 1), by.y + stride * (i / 3 - 1)};
    };
    std::array<double, 9> costs{};
    for_each_index(workers.executor, 9, [&](int i) { costs[i] = fine_.cost(cells, neighbour(i), step); });
    int least = 4;
    for (int i = 0; i < 9; ++i) least = costs[i] < costs[least] ? i : least;
    by = neighbour(least);
  }
  const double of_fine = deviation(1, static_cast<double>(cells.width) * cells.height / step);
  const double gain = fine_.cost(cells, {}, step) - fine_.cost(cells, by, step);
  return gain > frame_significance * of_fine ? by : Displacement{};
}

double FrameMotion::Search::mean_fraction(const Rect& blocks) const {
  double sum = 0;
  for (int y = blocks.y; y < blocks.y + blocks.height; ++y) {
    for (int x = blocks.x; x < blocks.x + blocks.width; ++x) sum += capped(before_.share.at(x, y));
  }
  return sum / (blocks.width * blocks.height);
}

/// Begins with the displacement of the frame, none, or that of the last frame, and follows the cost.
void FrameMotion::Search::displace_tile(int tile_x, int tile_y, Displacement of_frame) const {
  Displacement& best = own_.of_tile_.at(tile_x, tile_y);
  best = {};
  const Rect part = cells_of(tile_cells * tile_x, tile_cells * tile_y, tile_cells);
  if (part.width <= 0 || part.height <= 0) return;
  const double share = mean_fraction(blocks_of(tile_x, tile_y));
  const double margin = significance * deviation(share, part.width * part.height);
  double least = never;
  const auto attempt = [&](Displacement by, double less) {
    const double cost = by == best && least < never ? least : fine_.cost(part, by);
    if (!(cost < least - less)) return false;
    least = cost;
    best = by;
    return true;
  };
  attempt(of_frame, 0);
  attempt({}, margin);
  attempt(own_.of_tile_before_.at(tile_x, tile_y), margin);
  const double of_noise = noise2 * (1 + share);
  for (int i = 0; i < tile_steps && least > of_noise; ++i) {
    const Displacement from = best;
    for (int k = 0; k < 9; ++k) attempt({from.x + k % 3 - 1, from.y + k / 3 - 1}, best == from ? margin : 0);
    if (best == from) break;
  }
}

/// Returns the mean relative variance of what a displaced block consists of.
float FrameMotion::Search::displaced_share(int block_x, int block_y, Displacement by) const {
  const int left = motion_block * block_x + 2 * by.x, top = motion_block * block_y + 2 * by.y;
  const int right = left + std::min(motion_block, width_ - motion_block * block_x);
  const int bottom = top + std::min(motion_block, height_ - motion_block * block_y);
  if (left < 0 || top < 0 || right > width_ || bottom > height_) return no_content;
  float sum = 0;
  for (int y = top / motion_block; y <= (bottom - 1) / motion_block; ++y) {
    for (int x = left / motion_block; x <= (right - 1) / motion_block; ++x) {
      const int width = std::min(right, motion_block * (x + 1)) - std::max(left, motion_block * x);
      const int height = std::min(bottom, motion_block * (y + 1)) - std::max(top, motion_block * y);
      sum += static_cast<float>(width * height) * before_.share.at(x, y);
    }
  }
  return sum / static_cast<float>((right - left) * (bottom - top));
}

/// Returns whether all cells that the slopes of a displaced block depend on exist.
bool FrameMotion::Search::has_slopes(int block_x, int block_y) const {
  const Displacement by = own_.of_block_.at(block_x, block_y);
  const int left = block_cells * block_x, top = block_cells * block_y;
  const int right = left + block_cells, bottom = top + block_cells;
  return right <= fine_.width && bottom <= fine_.height && left + by.x >= 1 && top + by.y >= 1 &&
         right + by.x < fine_.width && bottom + by.y < fine_.height;
}

/// Measures the slopes of blocks side by side that have the same displacement, at once.
void FrameMotion::Search::measure_slopes(const Rect& blocks) const {
  for (int y = blocks.y; y < blocks.y + blocks.height; ++y) {
    for (int x = blocks.x, next = x; x < blocks.x + blocks.width; x = next) {
      const Displacement by = own_.of_block_.at(x, y);
      const bool known = has_slopes(x, y);
      for (next = x + 1; next < blocks.x + blocks.width; ++next) {
        if (own_.of_block_.at(next, y) != by || has_slopes(next, y) != known) break;
      }
      if (!known) continue;
      const int left = block_cells * x, top = block_cells * y;
      rows::block_slopes({own_.frame_.row(top) + left, own_.frame_.width(), own_.mean_.row(top + by.y) + left + by.x,
                          own_.mean_.width()},
                         next - x, &own_.slopes_.at(x, y));
    }
  }
}

/// Returns the residual displacement of a tile: least squares over its blocks that have its displacement.
FrameMotion::Residual FrameMotion::Search::fit(int tile_x, int tile_y) const {
  double xx = noise2, xy = 0, yy = noise2, xd = 0, yd = 0;
  const Rect blocks = blocks_of(tile_x, tile_y);
  for (int y = blocks.y; y < blocks.y + blocks.height; ++y) {
    for (int x = blocks.x; x < blocks.x + blocks.width; ++x) {
      if (own_.of_block_.at(x, y) != own_.of_tile_.at(tile_x, tile_y) || !has_slopes(x, y)) continue;
      const rows::BlockSlopes& of = own_.slopes_.at(x, y);
      const double noise = slope_noise(share_.at(x, y));
      xx += of.xx - noise, xy += of.xy, yy += of.yy - noise, xd += of.xd, yd += of.yd;
    }
  }
  xx = std::max(xx, noise2), yy = std::max(yy, noise2);
  const double determinant = std::max(xx * yy - xy * xy, 0.05 * xx * yy);
  const auto limited = [](double cells) { return std::clamp(cells, -max_residual_cells, max_residual_cells); };
  return {limited(2 * (yy * xd - xy * yd) / determinant), limited(2 * (xx * yd - xy * xd) / determinant)};
}

/// Chooses the displacement of each block of a tile among those of the tile and its neighbours.
void FrameMotion::Search::displace_blocks(int tile_x, int tile_y) const {
  const Displacement of_tile = own_.of_tile_.at(tile_x, tile_y);
  std::array<Displacement, 9> choices{of_tile};
  int count = 1;
  each_neighbour(tile_x, tile_y, [&](int x, int y) {
    const Displacement other = own_.of_tile_.at(x, y);
    if (std::find(choices.begin(), choices.begin() + count, other) == choices.begin() + count) choices[count++] = other;
  });
  const Rect blocks = blocks_of(tile_x, tile_y);
  for (int y = blocks.y; y < blocks.y + blocks.height; ++y) {
    for (int x = blocks.x; x < blocks.x + blocks.width; ++x) {
      Displacement& best = own_.of_block_.at(x, y);
      best = of_tile;
      const Rect part = cells_of(block_cells * x, block_cells * y, block_cells);
      if (count > 1 && part.width > 0 && part.height > 0) {
        const double margin = significance * deviation(capped(before_.share.at(x, y)), part.width * part.height);
        double least = fine_.cost(part, of_tile) - margin;
        for (int i = 1; i < count; ++i) {
          const double cost = fine_.cost(part, choices[i]);
          if (cost < least) least = cost, best = choices[i];
        }
      }
      share_.at(x, y) = displaced_share(x, y, best);
    }
  }
  measure_slopes(blocks);
  own_.residual_.at(tile_x, tile_y) = fit(tile_x, tile_y);
}

/// Adds to the relative variance of each block the mean square of what the residual displacement changes, as far as
/// the block's own difference shows it.
void FrameMotion::Search::add_mismatch(int tile_x, int tile_y) const {
  const Rect blocks = blocks_of(tile_x, tile_y);
  for (int y = blocks.y; y < blocks.y + blocks.height; ++y) {
    for (int x = blocks.x; x < blocks.x + blocks.width; ++x) {
      if (!has_slopes(x, y)) continue;
      const Displacement by = own_.of_block_.at(x, y);
      Residual residual = own_.residual_.at(tile_x, tile_y);
      if (by != own_.of_tile_.at(tile_x, tile_y)) {
        each_neighbour(tile_x, tile_y, [&](int u, int v) {
          if (own_.of_tile_.at(u, v) == by) residual = own_.residual_.at(u, v);
        });
      }
      const rows::BlockSlopes& of = own_.slopes_.at(x, y);
      const double noise = slope_noise(share_.at(x, y));
      const double expected = (residual.x_cells * residual.x_cells * std::max(of.xx - noise, 0.0) +
                               residual.y_cells * residual.y_cells * std::max(of.yy - noise, 0.0) +
                               2 * residual.x_cells * residual.y_cells * of.xy) /
                              4;
      const double seen = (residual.x_cells * of.xd + residual.y_cells * of.yd) / 2;
      // Over the variance of a raw value, which is four times that of the mean of a cell.
      const double added =
          mismatch_of_sites * std::clamp(seen, 0.0, std::max(expected, 0.0)) / (4 * block_cells * block_cells * noise2);
      share_.at(x, y) = std::min(share_.at(x, y) + static_cast<float>(added), no_content);
      own_.mismatch_[tile_y] += std::min(added, 1.0);
    }
  }
}

FrameMotion::FrameMotion(int max_width, int max_height)
    // Kernels may read up to two tiles from the start of a tile.
    : frame_(max_width / 2 + 2 * tile_cells, max_height / 2 + 1),
      mean_(frame_.width(), frame_.height()),
      coarse_frame_(max_width / (2 * coarse), max_height / (2 * coarse)),
      coarse_mean_(coarse_frame_.width(), coarse_frame_.height()),
      of_tile_(tile_count(max_width), tile_count(max_height)),
      of_tile_before_(of_tile_.width(), of_tile_.height()),
      of_block_(tile_blocks * of_tile_.width(), tile_blocks * of_tile_.height()),
      slopes_(of_block_.width(), of_block_.height()),
      residual_(of_tile_.width(), of_tile_.height()),
      cost_(std::size_t{2 * reach + 1} * (2 * reach + 1)),
      mismatch_(static_cast<std::size_t>(of_tile_.height())) {
  for (Plane<std::int16_t>* plane : {&frame_, &mean_}) std::fill_n(plane->data(), plane->size(), std::int16_t{0});
  forget();
}

void FrameMotion::forget() { std::fill_n(of_tile_.data(), of_tile_.size(), Displacement{}); }

void FrameMotion::find(const RawElectronsView& raw, const rows::SiteNoise& noise, const Before& before,
                       PlaneView<float> share, const Workers& workers) {
  const int columns = tile_count(raw.value.width), rows_of_tiles = tile_count(raw.value.height);
  const Search search(*this, before, raw.value.width, raw.value.height, share);
  std::swap(of_tile_, of_tile_before_);
  search.stabilise(raw, noise, workers);
  const Displacement of_frame = search.of_frame(workers);
  const auto each_tile = [&](const auto& work) {
    in_bands(workers, rows_of_tiles, [&](int first, int last, int) {
      for (int y = first; y < last; ++y) {
        for (int x = 0; x < columns; ++x) work(x, y);
      }
    });
  };
  std::fill(mismatch_.begin(), mismatch_.end(), 0.0);
  each_tile([&](int x, int y) { search.displace_tile(x, y, of_frame); });
  each_tile([&](int x, int y) { search.displace_blocks(x, y); });
  each_tile([&](int x, int y) { search.add_mismatch(x, y); });
  int displaced = 0;
  for (int y = 0; y < rows_of_tiles; ++y) {
    for (int x = 0; x < columns; ++x) displaced += of_tile_.at(x, y) == Displacement{} ? 0 : 1;
  }
  const double mismatch = std::accumulate(mismatch_.begin(), mismatch_.end(), 0.0);
  found_ = displaced > min_displaced * columns * rows_of_tiles || mismatch > min_mismatch * share.width * share.height;
}

}  // namespace lowlux::denoise
