#include "isp/pipeline/budget/frame_sample.h"

#include <algorithm>

#include "isp/pipeline/render/electron_mosaic.h"

namespace lowlux::isp {
namespace {

constexpr double min_gain = 2;  // a sample covers half the frame at most

/// Returns the position of square `i` along one direction: even, and evenly spread.
int place(int i, int count, int size) {
  const int room = size - sample_side_px;
  return (count == 1 ? room / 2 : room * i / (count - 1)) & ~1;
}

}  // namespace

std::vector<Rect> sample_squares(const RawFrame& frame, const RawLevels& levels) {
  const Rect& active = frame.raw.active;
  const double pixels = static_cast<double>(active.width) * active.height;
  const bool even = !levels.black.pattern && !levels.dark_frame;
  if (!even || 1e-6 * pixels < min_gain * sample_megapixels || active.width < sample_squares_along * sample_side_px ||
      active.height < sample_squares_down * sample_side_px) {
    return {};
  }
  std::vector<Rect> out;
  out.reserve(sample_squares_along * sample_squares_down);
  for (int j = 0; j < sample_squares_down; ++j) {
    for (int i = 0; i < sample_squares_along; ++i) {
      out.push_back({place(i, sample_squares_along, active.width), place(j, sample_squares_down, active.height),
                     sample_side_px, sample_side_px});
    }
  }
  return out;
}

RawElectrons sample_electrons(const RawFrame& frame, const RawLevels& levels, std::span<const Rect> squares,
                              Executor& executor) {
  RawElectrons out{Plane<float>(sample_side_px, sample_side_px * static_cast<int>(squares.size())), frame.raw.phase};
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const PlaneView<float> part =
        out.value.view().crop(0, sample_side_px * static_cast<int>(i), sample_side_px, sample_side_px);
    raw_electrons(frame, levels, squares[i], part, executor);
  }
  return out;
}

RawElectrons sample_of(const RawElectrons& charge, std::span<const Rect> squares) {
  RawElectrons out{Plane<float>(sample_side_px, sample_side_px * static_cast<int>(squares.size())), charge.phase};
  for (int y = 0; y < out.value.height(); ++y) {
    const Rect& square = squares[static_cast<std::size_t>(y / sample_side_px)];
    std::copy_n(charge.value.row(square.y + y % sample_side_px) + square.x, sample_side_px, out.value.row(y));
  }
  return out;
}

NoiseRatio sample_ratio(const NoiseRatioView& ratio, std::span<const Rect> squares) {
  constexpr int block_px = 16, side = sample_side_px / block_px;
  static_assert(sample_side_px % block_px == 0);
  NoiseRatio out{.block_px = block_px, .ratio = Plane<float>(side, side * static_cast<int>(squares.size()))};
  for (int y = 0; y < out.ratio.height(); ++y) {
    const Rect& square = squares[static_cast<std::size_t>(y / side)];
    for (int x = 0; x < side; ++x) {
      const int left = square.x + x * block_px, top = square.y + y % side * block_px;
      out.ratio.at(x, y) = static_cast<float>(ratio.mean(left, top, block_px, block_px));
    }
  }
  return out;
}

}  // namespace lowlux::isp
