#pragma once

#include <algorithm>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

// Grids have one sample for each cell; halved grids have cells of twice the side. The ends of rows and columns are
// repeated.

/// Returns the number of cells of twice the side along a side of n cells.
constexpr int halved(int n) { return (n + 1) / 2; }

/// Writes the mean of each 2 x 2 cells; `out` is halved() in both directions.
void halve(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor);

/// Interpolates linearly at the centres of the smaller cells: weights 3/4 and 1/4 in both directions.
/// @param out  in.width = halved(out.width), and so for heights
void interpolate_twice(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor);

/// Applies a Gaussian of a standard deviation in cells, 0..8, cut at three of them; `scratch` is as large as `plane`.
void blur(const PlaneView<float>& plane, double std_cells, const PlaneView<float>& scratch, Executor& executor);

/// Holds a plane and its halved versions, for the largest frame; smaller frames use the upper left corner.
class Pyramid {
 public:
  Pyramid(int width, int height, int levels) {
    for (int k = 0; k < levels; ++k, width = halved(width), height = halved(height)) level_.emplace_back(width, height);
  }
  void fit(int width, int height) {
    width_ = width;
    height_ = height;
  }
  PlaneView<float> operator[](int level) {
    int width = width_, height = height_;
    for (int k = 0; k < level; ++k) width = halved(width), height = halved(height);
    return level_[level].view().crop(0, 0, width, height);
  }
  void halve_to(int last, Executor& executor) {
    for (int k = 0; k < last; ++k) halve((*this)[k], (*this)[k + 1], executor);
  }
  /// Interpolates from a coarser level down to a finer one.
  void interpolate(int from, int to, Executor& executor) {
    for (int k = from; k > to; --k) interpolate_twice((*this)[k], (*this)[k - 1], executor);
  }

 private:
  std::vector<Plane<float>> level_;
  int width_ = 0;
  int height_ = 0;
};

/// Calls work(y) for each row, on several threads.
template <class Work>
void for_each_row(Executor& executor, int height, const Work& work) {
  for_each_band(executor, height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) work(y);
  });
}

/// Returns the number of levels down to one cell.
inline int levels_of(int width, int height) {
  int levels = 1;
  for (int side = std::max(width, height); side > 1; side = halved(side)) ++levels;
  return levels;
}

}  // namespace lowlux::isp
