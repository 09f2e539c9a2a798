#include "isp/raw/measure/frame_meter.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "isp/base/packed/raw_format.h"
#include "isp/raw/measure/meter_rows.h"

namespace lowlux::isp {
namespace {

/// Returns the side of a tile: a multiple of the thumbnail block's side, at least 16 pixels.
int tile_of(int block) { return block * ((16 + block - 1) / block); }

std::array<std::uint16_t, 4> luma_weights(const RawDn& raw) {
  constexpr std::array<std::uint16_t, 3> of_colour{77, 75, 29};
  std::array<std::uint16_t, 4> out{64, 64, 64, 64};
  if (raw.layout != SensorLayout::bayer) return out;
  for (int site = 0; site < 4; ++site) {
    out[site] = of_colour[static_cast<int>(colour_at(raw.phase, site & 1, site >> 1))];
  }
  return out;
}

}  // namespace

struct FrameMeter::Job {
  std::span<const std::byte> bytes;
  std::size_t stride;
  RawDn& raw;
  MeterWants wants;
  int bands;
};

FrameMeter::FrameMeter(const RawDn& raw, const RawFormat& format, int threads)
    : format_(format),
      thumbnail_(raw),
      tiles_(raw.active.width, raw.active.height, tile_of(thumbnail_.block())),
      tallies_(static_cast<std::size_t>(threads)),
      columns_(static_cast<std::size_t>(threads)) {
  const auto width = static_cast<std::size_t>(raw.active.width);
  for (Columns& columns : columns_) {
    for (int parity = 0; parity < 2; ++parity) {
      columns.sum[parity].resize(width);
      columns.square[parity].resize(width);
    }
    columns.bin.resize(width / 2);
  }
}

namespace {

template <class Tally>
void count_masked(const RawDn& raw, int y, Tally& tally) {
  for (const Rect& masked : raw.masked) {
    if (y < masked.y || y >= masked.y + masked.height) continue;
    const std::uint16_t* const row = raw.dn.row(y);
    for (int x = masked.x; x < masked.x + masked.width; ++x) {
      // Sites count from the active area's corner; only parity matters.
      const int site = site_of(x + (raw.active.x & 1), y + (raw.active.y & 1));
      tally.masked_sum[site] += row[x];
      ++tally.masked_count[site];
    }
  }
}

}  // namespace

namespace {

/// Adds the sums of the even and of the odd columns of rows of one parity to those of their sites.
void add_sites(std::span<const std::uint32_t> columns, int parity, PerSite<std::uint64_t>& sum) {
  std::uint64_t even = 0, odd = 0;
  std::size_t x = 0;
  for (; x + 1 < columns.size(); x += 2) {
    even += columns[x];
    odd += columns[x + 1];
  }
  if (x < columns.size()) even += columns[x];
  sum[2 * parity] += even;
  sum[2 * parity + 1] += odd;
}

}  // namespace

// Counts the cells of rows y - 1 and y of the active area.
void FrameMeter::count_cells(const RawDn& raw, int y, int thread) {
  std::vector<std::uint16_t>& bin = columns_[static_cast<std::size_t>(thread)].bin;
  const meter::LumaBins how{luma_weights(raw), format_.bits - 10, FrameStatistics::bins - 1};
  meter::luma_bins(raw.dn.row(raw.active.y + y - 1) + raw.active.x, raw.dn.row(raw.active.y + y) + raw.active.x,
                   raw.active.width, how, bin.data());
  auto& luma = tallies_[static_cast<std::size_t>(thread)].luma;
  std::size_t i = 0;
  for (; i + 1 < bin.size(); i += 2) {  // two histograms, because equal neighbouring bins would serialise the updates
    ++luma[0][bin[i]];
    ++luma[1][bin[i + 1]];
  }
  if (i < bin.size()) ++luma[0][bin[i]];
}

// Measures row y of the active area.
void FrameMeter::measure_row(const RawDn& raw, int y, const MeterWants& wants, int thread) {
  const int width = raw.active.width;
  if (wants.statistics) {
    const std::uint16_t* const dn = raw.dn.row(raw.active.y + y) + raw.active.x;
    const auto white = static_cast<std::uint16_t>(std::ceil(raw.white_dn[1]));  // codes are whole
    const auto found = meter::count_extremes(dn, width, white);
    Tally& tally = tallies_[static_cast<std::size_t>(thread)];
    tally.clipped += found.clipped;
    tally.zero += found.zero;
    if ((y & 3) == 1) count_cells(raw, y, thread);
  }
  if ((y + 1) % thumbnail_.block() == 0 || y + 1 == raw.active.height) measure_block(raw, y, wants, thread);
}

// Measures the block of rows that ends with row y, while its codes are in the cache.
void FrameMeter::measure_block(const RawDn& raw, int y, const MeterWants& wants, int thread) {
  const int block = thumbnail_.block(), block_row = y / block, first = block_row * block, rows = y - first + 1;
  Columns& columns = columns_[static_cast<std::size_t>(thread)];
  for (int parity = 0; parity < std::min(rows, 2); ++parity) {
    const std::uint16_t* const dn = raw.dn.row(raw.active.y + first + parity) + raw.active.x;
    const meter::CodeRows in{dn, 2 * raw.dn.view().stride, (rows + 1 - parity) / 2, raw.active.width};
    std::uint32_t* const sum = columns.sum[parity].data();
    wants.noise ? meter::sum_columns(in, sum, columns.square[parity].data()) : meter::sum_columns(in, sum);
    if (wants.statistics) add_sites(columns.sum[parity], parity, tallies_[static_cast<std::size_t>(thread)].sum);
  }
  if (rows == 1) std::ranges::fill(columns.sum[1], 0U);
  const std::array<const std::uint32_t*, 2> sum{columns.sum[0].data(), columns.sum[1].data()};
  const std::array<const std::uint32_t*, 2> square{columns.square[0].data(), columns.square[1].data()};
  if (wants.light) thumbnail_.add_columns(sum, block_row, rows);
  const bool whole_tile = y / tiles_.tile() < raw.active.height / tiles_.tile();
  if (wants.noise && whole_tile) tiles_.add_columns(sum, square, y / tiles_.tile());
}

void FrameMeter::read_rows(const Job& job, RowBand rows, int thread) {
  RawDn& raw = job.raw;
  const bool measures = job.wants.light || job.wants.noise || job.wants.statistics;
  for (int y = rows.first; y < rows.last; ++y) {
    unpack_row(format_, job.bytes.data() + static_cast<std::size_t>(y) * job.stride, raw.dn.width(), raw.dn.row(y));
    if (!raw.masked.empty()) count_masked(raw, y, tallies_[static_cast<std::size_t>(thread)]);
    const int active = y - raw.active.y;
    if (measures && active >= 0 && active < raw.active.height) measure_row(raw, active, job.wants, thread);
  }
}

void FrameMeter::read(std::span<const std::byte> bytes, std::size_t stride, RawDn& raw, Executor& executor,
                      const MeterWants& wants) {
  assert(bytes.size() >= stride * static_cast<std::size_t>(raw.dn.height() - 1) + row_bytes(format_, raw.dn.width()));
  wanted_ = wants;
  if (wants.light) thumbnail_.clear();
  if (wants.noise) tiles_.clear();
  const Job job{bytes, stride, raw, wants, std::min(executor.width(), static_cast<int>(tallies_.size()))};
  for_each_index(executor, job.bands, [&](int index) {
    tallies_[static_cast<std::size_t>(index)] = {};
    // Bands consist of complete tiles of the active area; the first and the last include the rows above and below it.
    const int tile = tiles_.tile(), tiles = (raw.active.height + tile - 1) / tile;
    const auto edge = [&](int i) { return raw.active.y + tile * (tiles * i / job.bands); };
    const int first = index == 0 ? 0 : edge(index);
    const int last = index + 1 == job.bands ? raw.dn.height() : edge(index + 1);
    read_rows(job, {first, last}, index);
  });
  add_up(raw, job.bands, wants);
}

void FrameMeter::add_up(const RawDn& raw, int threads, const MeterWants& wants) {
  masked_sum_ = masked_count_ = {};
  statistics_ = {};
  PerSite<std::uint64_t> sums{};
  for (int i = 0; i < threads; ++i) {
    const Tally& tally = tallies_[static_cast<std::size_t>(i)];
    for (int site = 0; site < 4; ++site) {
      masked_sum_[site] += tally.masked_sum[site];
      masked_count_[site] += tally.masked_count[site];
    }
    if (!wants.statistics) continue;
    for (int site = 0; site < 4; ++site) sums[site] += tally.sum[site];
    statistics_.clipped += tally.clipped;
    statistics_.zero += tally.zero;
    for (std::size_t k = 0; k < FrameStatistics::bins; ++k) statistics_.luma[k] += tally.luma[0][k] + tally.luma[1][k];
  }
  if (!wants.statistics) return;
  statistics_.pixels = static_cast<std::uint64_t>(raw.active.width) * static_cast<std::uint64_t>(raw.active.height);
  for (int site = 0; site < 4; ++site) {
    const int x = site & 1, y = site >> 1;
    const auto n = static_cast<std::uint64_t>((raw.active.width + 1 - x) / 2) *
                   static_cast<std::uint64_t>((raw.active.height + 1 - y) / 2);
    for (int c = 0; c < 3; ++c) {
      if (raw.layout == SensorLayout::bayer && static_cast<int>(colour_at(raw.phase, x, y)) != c) continue;
      statistics_.sum[c] += sums[site];
      statistics_.count[c] += n;
    }
  }
}

std::optional<PerSite<double>> FrameMeter::masked_dn() const {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) {
    if (masked_count_[site] == 0) return std::nullopt;
    out[site] = static_cast<double>(masked_sum_[site]) / static_cast<double>(masked_count_[site]);
  }
  return out;
}

}  // namespace lowlux::isp
