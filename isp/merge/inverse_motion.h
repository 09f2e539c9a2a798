#pragma once

#include <cstddef>
#include <vector>

#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Where the content of a frame lies in the reference: the inverse of a Motion, at the corners of square cells of the
/// frame. Within a cell it is interpolated bilinearly, which is exact for translation, rotation and scale.
struct InverseMotion {
  static constexpr int cell_px = 32;

  int columns = 0;  // number of columns of cells; nodes have one column more
  int rows = 0;
  std::vector<Point> nodes;  // at (column * cell_px, row * cell_px) of the frame; NaN where there is no inverse
  std::vector<double> area;  // area of a pixel of the frame in pixels of the reference, for each cell

  const Point& node(int column, int row) const {
    return nodes[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns + 1) +
                 static_cast<std::size_t>(column)];
  }
};

/// Finds places of the reference by Newton's method: what is at `frame` of a frame is at at(frame) of the reference.
/// Outside of its nodes a motion continues linearly. Both are NaN where there is no inverse.
class MotionInverse {
 public:
  explicit MotionInverse(const Motion& motion);
  Point at(const Point& frame) const;

 private:
  const Motion& motion_;
  Point origin_, by_x_, by_y_;  // the motion as one linear map, by its outer nodes: where the search starts
};

/// Inverts a motion for a frame of width x height pixels. Areas are means over 9 x 9 cells, as displacements are single
/// precision.
InverseMotion inverse_of(const Motion& motion, int width, int height);

}  // namespace lowlux::merge
