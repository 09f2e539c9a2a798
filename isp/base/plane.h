#pragma once

#include <cassert>
#include <cstddef>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>

#include "isp/base/memory.h"

namespace lowlux {

/// Borrows rows of samples: `height` rows of `width`, `stride` samples from one row to the next. A view is valid only
/// as long as its owner, and is passed by value.
template <class T>
struct PlaneView {
  T* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;

  T* row(int y) const {
    assert(y >= 0 && y < height);
    return data + y * stride;
  }
  T& at(int x, int y) const {
    assert(x >= 0 && x < width);
    return row(y)[x];
  }
  /// Returns the rectangle of this view with its corner at (x, y); it must lie inside.
  PlaneView crop(int x, int y, int crop_width, int crop_height) const {
    assert(x >= 0 && y >= 0 && crop_width >= 0 && crop_height >= 0);
    assert(x + crop_width <= width && y + crop_height <= height);
    return {data + y * stride + x, crop_width, crop_height, stride};
  }
  operator PlaneView<const T>() const requires(!std::is_const_v<T>) { return {data, width, height, stride}; }
};

/// Owns samples, stored row after row. New planes are not initialised; copies are made with clone(); a moved-from plane
/// is empty.
template <class T>
class Plane {
 public:
  Plane() = default;
  Plane(int width, int height)
      : width_(width),
        height_(height),
        samples_(std::make_unique_for_overwrite<T[]>(static_cast<std::size_t>(width) * height)) {
    assert(width >= 0 && height >= 0);
    prefer_huge_pages(samples_.get(), size() * sizeof(T));
  }
  Plane(Plane&& other) noexcept
      : width_(std::exchange(other.width_, 0)),
        height_(std::exchange(other.height_, 0)),
        samples_(std::move(other.samples_)) {}
  Plane& operator=(Plane&& other) noexcept {
    width_ = std::exchange(other.width_, 0);
    height_ = std::exchange(other.height_, 0);
    samples_ = std::move(other.samples_);
    return *this;
  }

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t size() const { return static_cast<std::size_t>(width_) * height_; }
  bool empty() const { return size() == 0; }

  T* data() { return samples_.get(); }
  const T* data() const { return samples_.get(); }
  T* row(int y) { return view().row(y); }
  const T* row(int y) const { return view().row(y); }
  T& at(int x, int y) { return view().at(x, y); }
  const T& at(int x, int y) const { return view().at(x, y); }

  PlaneView<T> view() { return {samples_.get(), width_, height_, width_}; }
  PlaneView<const T> view() const { return {samples_.get(), width_, height_, width_}; }

  Plane clone() const {
    static_assert(std::is_trivially_copyable_v<T>);
    Plane copy(width_, height_);
    if (!empty()) std::memcpy(copy.data(), data(), size() * sizeof(T));
    return copy;
  }

 private:
  int width_ = 0;
  int height_ = 0;
  std::unique_ptr<T[]> samples_;
};

/// Reallocates the plane if it has another size. Its contents are then not initialised.
template <class T>
void fit(Plane<T>& plane, int width, int height) {
  if (plane.width() != width || plane.height() != height) plane = Plane<T>(width, height);
}

}  // namespace lowlux
