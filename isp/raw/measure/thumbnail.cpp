#include "isp/raw/measure/thumbnail.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <type_traits>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr int max_blocks = 256;    // in either direction
constexpr int enough_blocks = 64;  // blocks along the longer side that suffice to make them twice as large
constexpr double difference_to_std =
    0.886226925452758;  // sqrt(pi) / 2: mean |a - b| of two normals is 2 std / sqrt(pi)

int block_of(const Rect& active) {
  const int side = std::max(active.width, active.height);
  const int block = std::max(side >= 8 * enough_blocks ? 8 : 4, (side + max_blocks - 1) / max_blocks);
  return block + (block & 1);
}

}  // namespace

ThumbnailSums::ThumbnailSums(const RawDn& raw)
    : block_(block_of(raw.active)),
      samples_(raw.layout == SensorLayout::linear_rgb ? 3 : 1),
      width_(raw.active.width),
      columns_((raw.active.width + block_ - 1) / block_),
      rows_((raw.active.height + block_ - 1) / block_),
      white_dn_(raw.white_dn),
      blocks_(static_cast<std::size_t>(columns_) * rows_) {
  differences_dn_.reserve(blocks_.size());
}

void ThumbnailSums::clear() { std::ranges::fill(blocks_, Block{}); }

namespace {

// Sums of codes in a row of a block fit in 32 bits, and vectorise.
template <class Sample>
using RowSum = std::conditional_t<std::is_same_v<Sample, float>, double, std::uint32_t>;

}  // namespace

// Adds one row of one block: sums of the even and of the odd columns.
template <class Sample>
void ThumbnailSums::add_mosaic(const Sample* dn, int width, int y, Sample white, Block& block) {
  RowSum<Sample> even = 0, odd = 0, difference = 0;
  std::uint32_t clipped = 0;
  for (int x = 0; x + 1 < width; x += 2) {
    even += dn[x];
    odd += dn[x + 1];
    clipped += (dn[x] >= white) + (dn[x + 1] >= white);
  }
  if (width & 1) {
    even += dn[width - 1];
    clipped += dn[width - 1] >= white;
  }
  for (int x = 0; x + 3 < width; x += 4) difference += static_cast<RowSum<Sample>>(std::abs(dn[x] - dn[x + 2]));
  const int left = site_of(0, y);
  block.sum[left] += even;
  block.sum[left + 1] += odd;
  block.n[left] += (width + 1) / 2;
  block.n[left + 1] += width / 2;
  block.clipped += clipped;
  block.difference += difference;
  block.differences += width / 4;
}

template <class Sample>
void ThumbnailSums::add_rgb(const Sample* dn, int width, Block& block) const {
  for (int x = 0; x < width; ++x) {
    if (x + 1 < width) block.difference += std::abs(dn[3 * x + 1] - dn[3 * x + 4]);
    for (int c = 0; c < 3; ++c) {
      block.sum[c] += dn[3 * x + c];
      block.clipped += dn[3 * x + c] >= white_dn_[c];
    }
  }
  block.differences += width - 1;
  for (int c = 0; c < 3; ++c) block.n[c] += width;
}

template <class Sample>
void ThumbnailSums::add_samples(const Sample* dn, int y, Sample white) {
  Block* const blocks = &blocks_[static_cast<std::size_t>(y / block_) * columns_];
  for (int b = 0; b < columns_; ++b) {
    const int x = b * block_;
    const int width = std::min(block_, width_ - x);
    if (samples_ == 3) {
      add_rgb(dn + 3 * x, width, blocks[b]);
    } else {
      add_mosaic(dn + x, width, y, white, blocks[b]);
    }
  }
}

void ThumbnailSums::add_row(const std::uint16_t* dn, int y) {
  add_samples(dn, y, static_cast<std::uint16_t>(std::min(65535.0, std::ceil(*std::ranges::min_element(white_dn_)))));
}

void ThumbnailSums::add_row(const float* dn, int y) {
  add_samples(dn, y, static_cast<float>(*std::ranges::min_element(white_dn_)));
}

void ThumbnailSums::add_columns(const std::array<const std::uint32_t*, 2>& columns, int block_row, int rows) {
  Block* const blocks = &blocks_[static_cast<std::size_t>(block_row) * columns_];
  for (int b = 0; b < columns_; ++b) {
    const int first = b * block_, width = std::min(block_, width_ - first);
    for (int parity = 0; parity < 2; ++parity) {
      const std::uint32_t* const column = columns[parity] + first;
      std::int64_t even = 0, odd = 0;
      for (int x = 0; x + 1 < width; x += 2) {
        even += column[x];
        odd += column[x + 1];
      }
      if ((width & 1) != 0) even += column[width - 1];
      const int of_parity = (rows + 1 - parity) / 2;
      blocks[b].sum[2 * parity] += static_cast<double>(even);
      blocks[b].sum[2 * parity + 1] += static_cast<double>(odd);
      blocks[b].n[2 * parity] += static_cast<std::int64_t>(of_parity) * ((width + 1) / 2);
      blocks[b].n[2 * parity + 1] += static_cast<std::int64_t>(of_parity) * (width / 2);
    }
  }
}

PerSite<std::uint64_t> ThumbnailSums::sums() const {
  PerSite<std::uint64_t> out{};
  for (const Block& block : blocks_) {
    for (int site = 0; site < 4; ++site) out[site] += static_cast<std::uint64_t>(block.sum[site]);
  }
  return out;
}

// Returns the mean of each colour over the block, as a fraction of white.
std::array<double, 3> ThumbnailSums::colour_means(const RawDn& raw, const BlackPoint& black,
                                                  const PerSite<double>& per_dn, const Block& block,
                                                  const std::array<double, 3>& beside) {
  std::array<double, 3> sum{};
  std::array<int, 3> n{};
  for (int i = 0; i < 4; ++i) {
    if (block.n[i] == 0) continue;
    const double mean = block.sum[i] / static_cast<double>(block.n[i]);
    const double fraction = (mean - black.pedestal_dn[i]) * per_dn[i];
    const auto add = [&](int c) {
      sum[c] += fraction;
      ++n[c];
    };
    switch (raw.layout) {
      case SensorLayout::bayer:
        add(static_cast<int>(colour_at(raw.phase, i & 1, i >> 1)));
        break;
      case SensorLayout::linear_rgb:
        add(std::min(i, 2));
        break;
      case SensorLayout::monochrome:
        add(0), add(1), add(2);
        break;
    }
  }
  for (int c = 0; c < 3; ++c) sum[c] = n[c] > 0 ? sum[c] / n[c] : beside[c];
  return sum;
}

double ThumbnailSums::black_noise(const RawFrame& frame, const BlackPoint& black) {
  const double range = mean_range_dn(frame.raw, black);
  const double measured = *std::max_element(black.noise_std_dn.begin(), black.noise_std_dn.end());
  if (measured > 0) return measured / range;
  if (frame.noise && frame.noise->offset[1] > 0) return std::sqrt(frame.noise->offset[1]);
  if (differences_dn_.empty()) return 0;
  const auto low = differences_dn_.begin() + static_cast<std::ptrdiff_t>(differences_dn_.size() / 20);
  std::nth_element(differences_dn_.begin(), low, differences_dn_.end());
  return difference_to_std * *low / range;
}

void ThumbnailSums::make(const RawFrame& frame, const BlackPoint& black, Thumbnail& out) {
  if (out.mean.width() != columns_ || out.mean.height() != rows_) {
    out.mean = CameraRgb(columns_, rows_);
    out.clipped = Plane<float>(columns_, rows_);
  }
  differences_dn_.clear();
  PerSite<double> per_dn{};
  for (int i = 0; i < 4; ++i) per_dn[i] = 1 / (white_at(frame.raw, i) - black.pedestal_dn[i]);
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      const Block& block = blocks_[static_cast<std::size_t>(y) * columns_ + x];
      std::array<double, 3> beside{};
      for (int c = 0; c < 3; ++c) {
        const Plane<float>& plane = out.mean.plane[c];
        if (x > 0 || y > 0) beside[c] = x > 0 ? plane.at(x - 1, y) : plane.at(x, y - 1);
      }
      const std::array<double, 3> mean = colour_means(frame.raw, black, per_dn, block, beside);
      for (int c = 0; c < 3; ++c) out.mean.plane[c].at(x, y) = static_cast<float>(mean[c]);
      const auto samples = std::accumulate(block.n.begin(), block.n.end(), std::int64_t{0});
      out.clipped.at(x, y) = static_cast<float>(static_cast<double>(block.clipped) / static_cast<double>(samples));
      if (block.difference > 0 && block.clipped == 0)
        differences_dn_.push_back(block.difference / static_cast<double>(block.differences));
    }
  }
  out.black_noise_std = black_noise(frame, black);
}

Thumbnail make_thumbnail(const RawFrame& frame, const BlackPoint& black, Executor& executor) {
  const RawDn& raw = frame.raw;
  ThumbnailSums sums(raw);
  for_each_band(executor, sums.block_rows(), [&](RowBand band, int) {
    const int end = std::min(band.last * sums.block(), raw.active.height);
    for (int y = band.first * sums.block(); y < end; ++y) {
      const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
      with_samples(raw, [&](const auto& dn) { sums.add_row(dn.row(raw.active.y + y) + raw.active.x * samples, y); });
    }
  });
  Thumbnail out;
  sums.make(frame, black, out);
  return out;
}

}  // namespace lowlux::isp
