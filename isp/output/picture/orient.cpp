#include "isp/output/picture/orient.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr int block = 64;  // pixels on a side: a block's source and destination stay in cache together

bool is_transposed(Orientation orientation) { return orientation >= Orientation::transpose; }

bool is_mirrored_x(Orientation o) {  // refers to the source
  return o == Orientation::mirror_horizontal || o == Orientation::rotate_180 || o == Orientation::transverse ||
         o == Orientation::rotate_270;
}

bool is_mirrored_y(Orientation o) {
  return o == Orientation::rotate_180 || o == Orientation::mirror_vertical || o == Orientation::rotate_90 ||
         o == Orientation::transverse;
}

/// Describes the source position of each pixel: one pixel to the right in the result is `x_step` samples further in the
/// source.
template <class T>
struct Walk {
  const T* origin = nullptr;
  std::ptrdiff_t x_step = 0;
  std::ptrdiff_t y_step = 0;
};

template <int Samples, class T>
Walk<T> walk_over(const Plane<T>& in, Orientation orientation) {
  const std::ptrdiff_t right = is_mirrored_x(orientation) ? -Samples : Samples;
  const std::ptrdiff_t down = is_mirrored_y(orientation) ? -in.width() : in.width();
  const T* origin = in.data() + (right < 0 ? in.width() - Samples : 0) + (down < 0 ? (in.height() - 1) * -down : 0);
  return is_transposed(orientation) ? Walk<T>{origin, down, right} : Walk<T>{origin, right, down};
}

/// Rotates or mirrors pixels of `Samples` interleaved samples, block by block.
template <int Samples, class T>
Plane<T> turned(const Plane<T>& in, Orientation orientation, Executor& executor) {
  const bool transposed = is_transposed(orientation);
  const int in_width = in.width() / Samples;
  const int width = transposed ? in.height() : in_width, height = transposed ? in_width : in.height();
  const Walk<T> walk = walk_over<Samples>(in, orientation);
  const int block_width = transposed ? block : width;  // without transposition rows need no blocks
  Plane<T> out(Samples * width, height);
  const auto turn_block = [&](int x0, int y0, int y1) {
    const int x1 = std::min(x0 + block_width, width);
    for (int y = y0; y < y1; ++y) {
      T* to = out.row(y);
      const T* from = walk.origin + y * walk.y_step;
      for (int x = x0; x < x1; ++x) std::memcpy(to + x * Samples, from + x * walk.x_step, Samples * sizeof(T));
    }
  };
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; y += block) {
      for (int x = 0; x < width; x += block_width) turn_block(x, y, std::min(y + block, band.last));
    }
  });
  return out;
}

template <class Code>
void turn(Encoded<Code>& picture, Orientation orientation, Executor& executor) {
  picture.codes = turned<3>(picture.codes, orientation, executor);
}

void turn(SceneLinear& picture, Orientation orientation, Executor& executor) {
  for (auto& plane : picture.plane) plane = turned<1>(plane, orientation, executor);
}

}  // namespace

Picture oriented(Picture picture, Orientation orientation, Executor& executor) {
  if (orientation == Orientation::normal) return picture;
  std::visit([&](auto& image) { turn(image, orientation, executor); }, picture);
  return picture;
}

}  // namespace lowlux::isp
