#include "isp/raw/kernel/residual_band.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "isp/raw/kernel/raw_to_rgb_bands.h"
#include "isp/raw/kernel/residual_rows.h"

namespace lowlux::isp {
namespace {

using rows::ConstSiteRow;
using rows::SiteRow;

constexpr int reach = 12;          // rows and columns on which a result depends, to each side
constexpr int halo = 16;           // columns of a block beyond those it makes
constexpr int block_width = 1024;  // at most
constexpr int chunk_rows = 4;      // made of one block before the next

// Pairs of a run before the first and after the last of a block: what kernels and splitting may touch. The first pair
// that kernels store starts a cache line.
constexpr int run_before = 32 + rows::run_margin;
constexpr int run_after = 32;

std::size_t odd_lines(std::size_t floats) { return (((floats + line_floats - 1) / line_floats) | 1U) * line_floats; }

/// Names the quantities of a block's rows.
enum Quantity {
  linear,
  encoded,
  horizontal,  // differences
  vertical,
  gradient_h,
  gradient_v,
  sum_h,
  sum_v,
  detail,
  shared,
  green,       // at the own colour
  difference,  // own colour - green at the own colour
  slope,
  mean_slope,
  rest,
  own_at_green,  // differences interpolated
  other,
  sums,  // memory of shared_detail_row and slope_row
  quantities
};

/// Holds how many rows of a quantity are live, and its runs per row.
struct RingSize {
  int rows;
  int runs;
};
constexpr std::array<RingSize, quantities> ring_sizes{{{13, 2},
                                                       {13, 2},
                                                       {5, 2},
                                                       {9, 2},
                                                       {3, 2},
                                                       {3, 2},
                                                       {3, 1},
                                                       {5, 1},
                                                       {5, 4},
                                                       {1, 1},
                                                       {7, 1},
                                                       {8, 1},
                                                       {5, 1},
                                                       {3, 1},
                                                       {3, 1},
                                                       {3, 1},
                                                       {3, 2},
                                                       {1, 4}}};

constexpr std::array<int, quantities + 1> first_runs() {
  std::array<int, quantities + 1> out{};
  for (std::size_t q = 0; q < quantities; ++q) out[q + 1] = out[q] + ring_sizes[q].rows * ring_sizes[q].runs;
  return out;
}
constexpr std::array<int, quantities + 1> first_run = first_runs();
constexpr std::size_t block_run = (run_before + block_width / 2 + run_after + line_floats - 1) / line_floats |
                                  1U;  // lines, an odd number: see run_stride_of
constexpr std::size_t block_floats = block_run * line_floats * first_run[quantities];

int blocks_of(int width) { return (width + block_width - 1) / block_width; }

/// Returns the pairs of columns of all blocks but the last.
int pairs_of(int width) { return (width + 2 * blocks_of(width) - 1) / (2 * blocks_of(width)); }

std::size_t made_stride(int width) { return odd_lines(run_of(width)); }

}  // namespace

std::size_t residual_floats(int width) {
  return static_cast<std::size_t>(blocks_of(width)) * block_floats + chunk_rows * 6 * made_stride(width);
}

/// Gives the runs of a block's rows.
template <class Mosaic>
struct ResidualBand<Mosaic>::Block {
  float* memory;
  int first;  // first column
  int pairs;

  float* run(Quantity quantity, int y, int which = 0) const {
    const RingSize& size = ring_sizes[quantity];
    const int slot = (y + 64 * size.rows) % size.rows;
    const int index = first_run[quantity] + slot * size.runs + which;
    return memory + static_cast<std::size_t>(index) * block_run * line_floats + run_before;
  }
  SiteRow sites(Quantity quantity, int y) const { return {run(quantity, y), run(quantity, y, 1)}; }
  ConstSiteRow at(Quantity quantity, int y) const { return {run(quantity, y), run(quantity, y, 1)}; }
};

template <class Mosaic>
ResidualBand<Mosaic>::ResidualBand(const Mosaic& in, const Demosaic& how, float clip, RowBand band, float* memory)
    : in_(in), clip_(clip), band_(band), median_(how.method == DemosaicMethod::residual_median), blocks_(memory) {
  const auto limited = [](float value, float low, float high) {
    return std::isnan(value) ? high : std::clamp(value, low, high);
  };
  encoding_ = encoding_with(how.offset);
  const float scale = std::cbrt(limited(how.white, 1e-3f, 1));
  ridge_ = 6e-4f * scale * scale;
  const float noise_std = limited(how.noise_std, 0, 1);
  floor_ = 1e-4f * scale + 4.5f * std::sqrt(1.75f) * noise_std;
  detail_floor_ = 1e-5f * scale * scale + 64 * noise_std * noise_std;  // 16 times what white noise adds to o
  made_ = memory + static_cast<std::size_t>(blocks_of(width_of(in))) * block_floats;
  next_ = band.first - reach;
}

template <class Mosaic>
SplitRow ResidualBand<Mosaic>::made(int y, int colour) const {
  const std::size_t stride = made_stride(width_of(in_));
  const int run = 6 * ((y - band_.first) % chunk_rows) + 2 * colour;
  float* const even = made_ + static_cast<std::size_t>(run) * stride + rows::padding_before;
  return {even, even + stride};
}

template <class Mosaic>
rows::PlaneRows ResidualBand<Mosaic>::row(int y) const {
  rows::PlaneRows out{};
  for (int c = 0; c < 3; ++c) {
    out.even[c] = made(y, c).even;
    out.odd[c] = made(y, c).odd;
  }
  return out;
}

template <class Mosaic>
int ResidualBand<Mosaic>::advance() {
  const int made = std::max(next_ - reach, band_.first), end = std::min(made + chunk_rows, band_.last);
  const int width = width_of(in_), pairs = pairs_of(width);
  for (int b = 0; b < blocks_of(width); ++b) {
    const Block block{blocks_ + static_cast<std::size_t>(b) * block_floats, 2 * pairs * b,
                      std::min(pairs, (width + 1) / 2 - pairs * b)};
    for (int y = next_; y < end + reach; ++y) add_row(block, y);
  }
  next_ = end + reach;
  return end;
}

/// Reads row y of a block, and takes each quantity as far as it then can be: the result is row y - reach.
template <class Mosaic>
void ResidualBand<Mosaic>::add_row(const Block& block, int y) const {
  read_row(block, y);
  add_green(block, y);
  add_differences(block, y);
  if (y - reach >= band_.first) finish_row(block, y - reach);
}

template <class Mosaic>
bool ResidualBand<Mosaic>::own_is_odd(int y) const {
  const bool has_red = (y & 1) == red_row(in_.phase);
  return (red_column(in_.phase) != 0) == has_red;
}

/// Reads and encodes row y, columns beyond the borders of the mosaic mirrored.
template <class Mosaic>
void ResidualBand<Mosaic>::read_row(const Block& block, int y) const {
  const int width = width_of(in_), height = height_of(in_), pairs = block.pairs;
  const auto runs = [&](Quantity quantity) {
    const SiteRow sites = block.sites(quantity, y);
    return own_is_odd(y) ? SplitRow{sites.green, sites.own} : SplitRow{sites.own, sites.green};
  };
  const SplitRow values = runs(linear), codes = runs(encoded);
  const int begin = std::max(block.first - halo, 0), end = std::min(block.first + 2 * pairs + halo, width);
  const int before = (block.first - begin) / 2;
  split_row(columns_of(in_, begin, end - begin), mirror(y, height), {values.even - before, values.odd - before});
  const auto copy_mirrored = [&](int x) {
    ((x & 1) != 0 ? values.odd : values.even)[x >> 1] = at(values, mirror(block.first + x, width) - block.first);
  };
  for (int x = -halo; x < begin - block.first; ++x) copy_mirrored(x);
  for (int x = end - block.first; x < 2 * pairs + halo; ++x) copy_mirrored(x);
  for (const auto& [from, to] : {std::pair{values.even, codes.even}, std::pair{values.odd, codes.odd}}) {
    rows::encode_row(from - rows::run_margin, clip_, encoding_, pairs + 2 * rows::run_margin, to - rows::run_margin);
  }
}

/// Computes differences of row y - 2 to green of row y - 6, each where a row of the band needs it.
template <class Mosaic>
void ResidualBand<Mosaic>::add_green(const Block& block, int y) const {
  const int pairs = block.pairs;
  const auto starts = [&](int row, int rows_beyond) { return row >= band_.first - rows_beyond; };
  if (const int k = y - 2; starts(k, 10)) {
    rows::difference_row({{block.at(encoded, k - 2), block.at(encoded, k - 1), block.at(encoded, k),
                           block.at(encoded, k + 1), block.at(encoded, k + 2)},
                          shift(k),
                          block.sites(horizontal, k),
                          block.sites(vertical, k)},
                         pairs);
  }
  if (const int k = y - 3; starts(k, 9)) {
    rows::gradient_row({block.at(horizontal, k), block.at(vertical, k - 1), block.at(vertical, k + 1), shift(k),
                        block.sites(gradient_h, k), block.sites(gradient_v, k)},
                       pairs);
  }
  if (const int k = y - 4; starts(k, 8)) {
    rows::gradient_sum_row({{block.at(gradient_h, k - 1), block.at(gradient_h, k), block.at(gradient_h, k + 1)},
                            {block.at(gradient_v, k - 1), block.at(gradient_v, k), block.at(gradient_v, k + 1)},
                            shift(k),
                            block.run(sum_h, k),
                            block.run(sum_v, k)},
                           pairs);
    rows::detail_row(
        {{block.at(encoded, k - 2), block.at(encoded, k - 1), block.at(encoded, k), block.at(encoded, k + 1),
          block.at(encoded, k + 2)},
         shift(k),
         {block.run(detail, k), block.run(detail, k, 1), block.run(detail, k, 2), block.run(detail, k, 3)}},
        pairs);
  }
  if (const int k = y - 6; starts(k, 6)) {
    const auto details = [&](int row) -> rows::DetailRow<const float> {
      return {block.run(detail, row), block.run(detail, row, 1), block.run(detail, row, 2), block.run(detail, row, 3)};
    };
    rows::shared_detail_row({{details(k - 2), details(k), details(k + 2)},
                             detail_floor_,
                             {block.run(sums, 0), block.run(sums, 0, 1), block.run(sums, 0, 2), block.run(sums, 0, 3)},
                             block.run(shared, k)},
                            pairs);
    rows::GreenRows in{.u = {block.at(encoded, k - 1), block.at(encoded, k), block.at(encoded, k + 1)},
                       .horizontal = block.at(horizontal, k),
                       .vertical = {},
                       .sum_h = block.run(sum_h, k),
                       .sum_above = block.run(sum_v, k - 2),
                       .sum_below = block.run(sum_v, k + 2),
                       .shared = block.run(shared, k),
                       .floor = floor_,
                       .shift = shift(k),
                       .green = block.run(green, k),
                       .difference = block.run(difference, k)};
    for (int j = 0; j < 9; ++j) in.vertical[j] = block.at(vertical, k - 4 + j);
    rows::green_row(in, pairs);
  }
}

/// Computes slopes of row y - 8 to interpolated differences of row y - 11.
template <class Mosaic>
void ResidualBand<Mosaic>::add_differences(const Block& block, int y) const {
  const int pairs = block.pairs;
  const auto starts = [&](int row, int rows_beyond) { return row >= band_.first - rows_beyond; };
  if (const int k = y - 8; starts(k, 4)) {
    rows::slope_row({{block.run(green, k - 2), block.run(green, k), block.run(green, k + 2)},
                     {block.run(difference, k - 2), block.run(difference, k), block.run(difference, k + 2)},
                     ridge_,
                     {block.run(sums, 0), block.run(sums, 0, 1), block.run(sums, 0, 2), block.run(sums, 0, 3)},
                     block.run(slope, k)},
                    pairs);
  }
  if (const int k = y - 10; starts(k, 2)) {
    rows::rest_row({{block.run(slope, k - 2), block.run(slope, k), block.run(slope, k + 2)},
                    block.run(green, k),
                    block.run(difference, k),
                    block.run(mean_slope, k),
                    block.run(rest, k)},
                   pairs);
  }
  if (const int k = y - 11; starts(k, 1)) {
    rows::colour_difference_row({{block.run(mean_slope, k - 1), block.run(mean_slope, k), block.run(mean_slope, k + 1)},
                                 {block.run(rest, k - 1), block.run(rest, k), block.run(rest, k + 1)},
                                 block.run(green, k),
                                 block.run(encoded, k, 1),
                                 shift(k),
                                 block.run(own_at_green, k),
                                 block.sites(other, k)},
                                pairs);
  }
}

template <class Mosaic>
void ResidualBand<Mosaic>::finish_row(const Block& block, int y) const {
  const int pairs = block.pairs;
  const int own = (y & 1) == red_row(in_.phase) ? 0 : 2, first = block.first / 2;
  const auto runs = [&](float* SplitRow::*column) -> rows::ColourRuns {
    return {made(y, own).*column + first, made(y, 1).*column + first, made(y, 2 - own).*column + first};
  };
  const rows::FinishRows in{
      .linear = block.at(linear, y),
      .green_at_own = block.run(green, y),
      .green = block.run(encoded, y, 1),
      .own = {{block.run(other, y - 1, 1), block.run(difference, y), block.run(other, y + 1, 1)},
              {block.run(other, y - 1), block.run(own_at_green, y), block.run(other, y + 1)}},
      .other = {{block.run(own_at_green, y - 1), block.run(other, y), block.run(own_at_green, y + 1)},
                {block.run(difference, y - 1), block.run(other, y, 1), block.run(difference, y + 1)}},
      .shift = shift(y),
      .median = median_,
      .at_own = runs(own_is_odd(y) ? &SplitRow::odd : &SplitRow::even),
      .at_green = runs(own_is_odd(y) ? &SplitRow::even : &SplitRow::odd)};
  rows::finish_row(in, encoding_, pairs);
}

template class ResidualBand<DnMosaic>;
template class ResidualBand<SignedMosaic>;

}  // namespace lowlux::isp
