#pragma once

#include <array>
#include <vector>

#include "isp/merge/stars/point_grid.h"

namespace lowlux::merge {

/// Three points of one list and the three of another that may be the same, by their indices.
struct TrianglePair {
  std::array<int, 3> first{};
  std::array<int, 3> second{};
};

/// Holds the options of matching_triangles().
struct TriangleOptions {
  double max_scale_change = 0.02;
  double tolerance = 0.004;   // tolerance of ratios of sides, in addition to...
  double place_error_px = 1;  // ...this divided by the longest side
};

/// Returns the pairs of triangles that a similarity without mirroring maps onto each other: those whose longest sides
/// agree within max_scale_change, whose shorter sides have the same ratios to it, and whose orientation is the same
/// (after Groth, AJ 91, 1986; Valdes et al., PASP 107, 1995). Triangles are those of each point and two of its eight
/// nearest neighbours; of up to 14 points, all. Where two sides are equal within the tolerance, both orders are tried.
/// Triangles with a height below a twentieth of their longest side, or a side below 8 px, are left out.
std::vector<TrianglePair> matching_triangles(const std::vector<Point>& first, const std::vector<Point>& second,
                                             const TriangleOptions& options);

}  // namespace lowlux::merge
