#include "isp/render/area_mean.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lowlux::isp {
namespace {

/// Holds the pixels of one axis that a pixel of the result covers: weights of the first and last, 1 in between.
struct Span {
  int first = 0;
  int last = 0;  // inclusive
  double first_weight = 1;
  double last_weight = 1;  // read only where last > first

  double weight(int i) const { return i == first ? first_weight : i == last ? last_weight : 1; }
};

/// Returns the span of pixel `index` of `count` over `size` pixels. Its ends are multiples of size / count, computed in
/// integers, so that spans meet without a gap.
Span span_of(int index, int count, int size) {
  const auto n = static_cast<std::int64_t>(count);
  const std::int64_t begin = std::int64_t{index} * size, end = begin + size;  // in units of 1 / count pixels
  Span out{static_cast<int>(begin / n), static_cast<int>((end - 1) / n)};
  const auto inside = [&](int pixel) {
    const std::int64_t low = std::max(begin, pixel * n), high = std::min(end, (pixel + 1) * n);
    return static_cast<double>(high - low) / static_cast<double>(n);
  };
  out.first_weight = inside(out.first);
  out.last_weight = inside(out.last);
  return out;
}

void shrink_row(const PlaneView<const float>& in, const Span& rows, std::span<double> sums, float* out, int width) {
  std::ranges::fill(sums, 0.0);
  for (int y = rows.first; y <= rows.last; ++y) {
    const double weight = rows.weight(y);
    const float* const row = in.row(y);
    for (int x = 0; x < in.width; ++x) sums[static_cast<std::size_t>(x)] += weight * row[x];
  }
  const double area = static_cast<double>(in.width) / width;
  double height = 0;
  for (int y = rows.first; y <= rows.last; ++y) height += rows.weight(y);
  for (int i = 0; i < width; ++i) {
    const Span columns = span_of(i, width, in.width);
    double sum = 0;
    for (int x = columns.first; x <= columns.last; ++x) sum += columns.weight(x) * sums[static_cast<std::size_t>(x)];
    out[i] = static_cast<float>(sum / (area * height));
  }
}

}  // namespace

void shrink_by_area(const RgbView<const float>& in, const RgbView<float>& out, Executor& executor) {
  assert(out[0].width >= 1 && out[0].height >= 1 && out[0].width <= in[0].width && out[0].height <= in[0].height);
  for_each_band(executor, out[0].height, [&](const RowBand& band, int /*index*/) {
    std::vector<double> sums(static_cast<std::size_t>(in[0].width));
    for (int y = band.first; y < band.last; ++y) {
      const Span rows = span_of(y, out[0].height, in[0].height);
      for (std::size_t c = 0; c < 3; ++c) shrink_row(in[c], rows, sums, out[c].row(y), out[c].width);
    }
  });
}

}  // namespace lowlux::isp
