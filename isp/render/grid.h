#pragma once

#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

// Grids with one sample for each cell, and the same with cells of twice the side. The ends of rows and columns are
// repeated.

/// Cells of twice the side along a side of n.
constexpr int halved(int n) { return (n + 1) / 2; }

/// Mean of each 2 x 2 cells; `out` is halved() in both directions.
void halve(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor);

/// Linear interpolation at the middles of the smaller cells: weights 3/4 and 1/4 in both directions.
/// @param out  in.width = halved(out.width), and so for heights
void interpolate_twice(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor);

/// Gaussian of a standard deviation in cells, 0..8, cut at three of them; `scratch` is as large as `plane`.
void blur(const PlaneView<float>& plane, double std_cells, const PlaneView<float>& scratch, Executor& executor);

}  // namespace lowlux::isp
