#pragma once

#include <cstddef>
#include <vector>

#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Sorts points into square cells, to find those near a place.
class PointGrid {
 public:
  /// @param cell_px above 0: about the radius of most searches, or the distance of points
  PointGrid(std::vector<Point> points, double cell_px);

  /// Returns the index of the point nearest to a place, of equal ones the first; -1 if none is within the radius.
  int nearest(const Point& place, double radius_px) const;

  /// Returns how many points are within the radius.
  int count(const Point& place, double radius_px) const;

  const Point& at(int index) const { return points_[static_cast<std::size_t>(index)]; }

 private:
  template <class Visit>
  void visit(const Point& place, double radius_px, const Visit& visit) const;

  std::vector<Point> points_;
  double cell_px_;
  double left_ = 0;
  double top_ = 0;
  int columns_ = 1;
  int rows_ = 1;
  std::vector<int> first_;  // index of the first point of each cell, in order_
  std::vector<int> order_;
};

}  // namespace lowlux::merge
