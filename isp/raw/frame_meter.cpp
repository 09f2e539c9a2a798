#include "isp/raw/frame_meter.h"

#include <algorithm>
#include <cassert>

#include "isp/base/unpack.h"

namespace lowlux::isp {
namespace {

/// A whole number of thumbnail blocks, at least 16 pixels.
int tile_of(int block) { return block * ((16 + block - 1) / block); }

std::array<std::uint32_t, 4> luma_weights(const RawDn& raw) {
  constexpr std::array<std::uint32_t, 3> of_colour{77, 75, 29};
  std::array<std::uint32_t, 4> out{64, 64, 64, 64};
  if (raw.layout != SensorLayout::bayer) return out;
  for (int site = 0; site < 4; ++site) {
    out[site] = of_colour[static_cast<int>(colour_at(raw.phase, site & 1, site >> 1))];
  }
  return out;
}

}  // namespace

FrameMeter::FrameMeter(const RawDn& raw, const RawFormat& format, int threads)
    : format_(format),
      thumbnail_(raw),
      tiles_(raw.active.width, raw.active.height, tile_of(thumbnail_.block())),
      tallies_(static_cast<std::size_t>(threads)) {}

void FrameMeter::count_masked(const RawDn& raw, int y, Tally& tally) {
  for (const Rect& masked : raw.masked) {
    if (y < masked.y || y >= masked.y + masked.height) continue;
    const std::uint16_t* const row = raw.dn.row(y);
    for (int x = masked.x; x < masked.x + masked.width; ++x) {
      // Sites count from the active area's corner; parity is all that matters.
      const int site = site_of(x + (raw.active.x & 1), y + (raw.active.y & 1));
      tally.masked_sum[site] += row[x];
      ++tally.masked_count[site];
    }
  }
}

// Row y of the active area.
void FrameMeter::count_row(const RawDn& raw, int y, Tally& tally) const {
  const std::uint16_t* const dn = raw.dn.row(raw.active.y + y) + raw.active.x;
  const int width = raw.active.width;
  const auto white = static_cast<std::uint16_t>(raw.white_dn[1]);
  std::uint32_t clipped = 0, zero = 0;
  std::uint64_t all = 0, odd = 0;
  for (int x = 0; x < width; ++x) {
    clipped += dn[x] >= white ? 1 : 0;
    zero += dn[x] == 0 ? 1 : 0;
  }
  std::uint32_t part_all = 0, part_odd = 0;  // 65536 codes of 16 bits fit
  for (int x = 0; x + 1 < width; x += 2) {
    part_all += static_cast<std::uint32_t>(dn[x]) + dn[x + 1];
    part_odd += dn[x + 1];
  }
  all += part_all, odd += part_odd;
  if ((width & 1) != 0) all += dn[width - 1];
  const int left = site_of(0, y);
  tally.sum[left] += all - odd;
  tally.sum[left + 1] += odd;
  tally.clipped += clipped;
  tally.zero += zero;
}

// The cells of rows y - 1 and y.
void FrameMeter::count_cells(const RawDn& raw, int y, Tally& tally) const {
  const std::uint16_t* const above = raw.dn.row(raw.active.y + y - 1) + raw.active.x;
  const std::uint16_t* const here = raw.dn.row(raw.active.y + y) + raw.active.x;
  const std::array<std::uint32_t, 4> weight = luma_weights(raw);
  constexpr std::uint32_t last = FrameStatistics::bins - 1;
  for (int x = 0; x + 1 < raw.active.width; x += 2) {
    const std::uint32_t luma =
        weight[0] * above[x] + weight[1] * above[x + 1] + weight[2] * here[x] + weight[3] * here[x + 1];
    // Eight bits of weights off; what lies beyond the format's codes counts in the last bin.
    const std::uint32_t code = luma >> 8;
    const std::uint32_t bin = format_.bits >= 10 ? code >> (format_.bits - 10) : code << (10 - format_.bits);
    ++tally.luma[std::min(bin, last)];
  }
}

void FrameMeter::read_rows(std::span<const std::byte> bytes, std::size_t stride, RawDn& raw, RowBand rows,
                           Tally& tally) {
  for (int y = rows.first; y < rows.last; ++y) {
    unpack_row(format_, bytes.data() + static_cast<std::size_t>(y) * stride, raw.dn.width(), raw.dn.row(y));
    if (!raw.masked.empty()) count_masked(raw, y, tally);
    const int active = y - raw.active.y;
    if (active < 0 || active >= raw.active.height) continue;
    const std::uint16_t* const dn = raw.dn.row(y) + raw.active.x;
    thumbnail_.add_row(dn, active);
    tiles_.add_row(dn, active);
    count_row(raw, active, tally);
    if ((active & 1) != 0) count_cells(raw, active, tally);
  }
}

void FrameMeter::read(std::span<const std::byte> bytes, std::size_t stride, RawDn& raw, Executor& executor) {
  assert(bytes.size() >= stride * static_cast<std::size_t>(raw.dn.height() - 1) + row_bytes(format_, raw.dn.width()));
  thumbnail_.clear();
  tiles_.clear();
  struct Call {
    FrameMeter& meter;
    std::span<const std::byte> bytes;
    std::size_t stride;
    RawDn& raw;
    int count;
  } call{*this, bytes, stride, raw, std::min(executor.width(), static_cast<int>(tallies_.size()))};
  executor.run(
      call.count,
      [](void* context, int index) {
        const Call& c = *static_cast<Call*>(context);
        Tally& tally = c.meter.tallies_[static_cast<std::size_t>(index)];
        tally = {};
        // Bands of whole tiles of the active area; the first and the last have the rows above and below it.
        const int tile = c.meter.tiles_.tile(), tiles = (c.raw.active.height + tile - 1) / tile;
        const auto edge = [&](int i) { return c.raw.active.y + tile * (tiles * i / c.count); };
        const int first = index == 0 ? 0 : edge(index);
        const int last = index + 1 == c.count ? c.raw.dn.height() : edge(index + 1);
        c.meter.read_rows(c.bytes, c.stride, c.raw, {first, last}, tally);
      },
      &call);
  total_ = {};
  for (int i = 0; i < call.count; ++i) {
    const Tally& tally = tallies_[static_cast<std::size_t>(i)];
    for (int site = 0; site < 4; ++site) {
      total_.sum[site] += tally.sum[site];
      total_.masked_sum[site] += tally.masked_sum[site];
      total_.masked_count[site] += tally.masked_count[site];
    }
    total_.clipped += tally.clipped;
    total_.zero += tally.zero;
    for (int k = 0; k < FrameStatistics::bins; ++k) total_.luma[k] += tally.luma[k];
  }
  add_up(raw);
}

void FrameMeter::add_up(const RawDn& raw) {
  statistics_ = {};
  statistics_.luma = total_.luma;
  statistics_.clipped = total_.clipped;
  statistics_.zero = total_.zero;
  statistics_.pixels = static_cast<std::uint64_t>(raw.active.width) * static_cast<std::uint64_t>(raw.active.height);
  for (int site = 0; site < 4; ++site) {
    const int x = site & 1, y = site >> 1;
    const auto n = static_cast<std::uint64_t>((raw.active.width + 1 - x) / 2) *
                   static_cast<std::uint64_t>((raw.active.height + 1 - y) / 2);
    for (int c = 0; c < 3; ++c) {
      if (raw.layout == SensorLayout::bayer && static_cast<int>(colour_at(raw.phase, x, y)) != c) continue;
      statistics_.sum[c] += total_.sum[site];
      statistics_.count[c] += n;
    }
  }
}

std::optional<PerSite<double>> FrameMeter::masked_dn() const {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) {
    if (total_.masked_count[site] == 0) return std::nullopt;
    out[site] = static_cast<double>(total_.masked_sum[site]) / static_cast<double>(total_.masked_count[site]);
  }
  return out;
}

}  // namespace lowlux::isp
