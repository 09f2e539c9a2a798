#include "isp/pipeline/budget/frame_sample.h"

#include <algorithm>

#include "isp/raw/repair.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr double min_gain = 2;  // a sample covers half the frame at most

/// Returns the position of square `i` along one direction: even, and evenly spread.
int place(int i, int count, int size) {
  const int room = size - sample_side_px;
  return (count == 1 ? room / 2 : room * i / (count - 1)) & ~1;
}

std::vector<Pixel> inside(const std::vector<Pixel>& defects, const Rect& square) {
  std::vector<Pixel> out;
  for (const Pixel& p : defects) {
    const int x = p.x - square.x, y = p.y - square.y;
    if (x >= 0 && y >= 0 && x < square.width && y < square.height) out.push_back({x, y});
  }
  return out;
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

RawDn square_codes(const RawDn& raw, const Rect& square) {
  RawDn out;
  out.dn = Plane<std::uint16_t>(square.width, square.height);
  for (int y = 0; y < square.height; ++y) {
    std::copy_n(raw.dn.row(raw.active.y + square.y + y) + raw.active.x + square.x, square.width, out.dn.row(y));
  }
  out.layout = raw.layout;
  out.phase = raw.phase;
  out.active = out.default_crop = {0, 0, square.width, square.height};
  out.white_dn = raw.white_dn;
  return out;
}

RawElectrons sample_electrons(const RawFrame& frame, const RawLevels& levels, std::span<const Rect> squares,
                              Executor& executor) {
  RawElectrons out{Plane<float>(sample_side_px, sample_side_px * static_cast<int>(squares.size())), frame.raw.phase};
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const RawDn codes = square_codes(frame.raw, squares[i]);
    const PlaneView<float> part =
        out.value.view().crop(0, sample_side_px * static_cast<int>(i), sample_side_px, sample_side_px);
    to_electrons(codes, levels.black, *levels.electrons_at_white, part, executor);
    repair(part, inside(levels.defects, squares[i]), 2);
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

}  // namespace lowlux::isp
