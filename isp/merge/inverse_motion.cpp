#include "isp/merge/inverse_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lowlux::merge {
namespace {

constexpr int max_newton_steps = 30;
constexpr double converged_px = 1e-7;
constexpr double solved_px = 1e-2;
constexpr double max_place_px = 1e6;

/// A place of the frame and its derivatives by the place of the reference.
struct MappedPoint {
  Point at;
  Point by_x;
  Point by_y;
};

/// Motion::at in double precision, with derivatives, and continued beyond the nodes.
MappedPoint map_point(const Motion& motion, const Point& p) {
  const double column = p.x / motion.spacing_px, row = p.y / motion.spacing_px;
  const int i = static_cast<int>(std::clamp(std::floor(column), 0.0, motion.dx_px.width() - 2.0));
  const int j = static_cast<int>(std::clamp(std::floor(row), 0.0, motion.dx_px.height() - 2.0));
  const double u = column - i, v = row - j;
  struct Component {
    double value, by_column, by_row;
  };
  const auto component = [&](const Plane<float>& plane) {
    const auto at = [&](int column_of, int row_of) { return static_cast<double>(plane.at(column_of, row_of)); };
    const double a = at(i, j), b = at(i + 1, j), c = at(i, j + 1), d = at(i + 1, j + 1);
    return Component{(1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d), (1 - v) * (b - a) + v * (d - c),
                     (1 - u) * (c - a) + u * (d - b)};
  };
  const Component x = component(motion.dx_px), y = component(motion.dy_px);
  const double spacing = motion.spacing_px;
  return {{p.x + x.value, p.y + y.value},
          {1 + x.by_column / spacing, y.by_column / spacing},
          {x.by_row / spacing, 1 + y.by_row / spacing}};
}

/// Returns the step of the reference that moves the frame's place by (dx, dy).
Point step_of(const MappedPoint& mapped, double dx, double dy) {
  const double determinant = mapped.by_x.x * mapped.by_y.y - mapped.by_y.x * mapped.by_x.y;
  return {(mapped.by_y.y * dx - mapped.by_y.x * dy) / determinant,
          (mapped.by_x.x * dy - mapped.by_x.y * dx) / determinant};
}

Point invert(const Motion& motion, const Point& start, const Point& frame) {
  Point p = start;
  double distance = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < max_newton_steps && distance > converged_px; ++iteration) {
    const MappedPoint mapped = map_point(motion, p);
    const Point step = step_of(mapped, frame.x - mapped.at.x, frame.y - mapped.at.y);
    p = {p.x + step.x, p.y + step.y};
    if (!(std::fabs(p.x) < max_place_px && std::fabs(p.y) < max_place_px)) break;
    const MappedPoint there = map_point(motion, p);
    distance = std::hypot(frame.x - there.at.x, frame.y - there.at.y);
  }
  if (distance <= solved_px) return p;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {nan, nan};
}

/// Returns the motion as one linear map, by its outer nodes: where Newton's method starts from.
MappedPoint linear_of(const Motion& motion) {
  const int last_column = motion.dx_px.width() - 1, last_row = motion.dx_px.height() - 1;
  const auto place = [&](int i, int j) {
    return Point{static_cast<double>(i) * motion.spacing_px + static_cast<double>(motion.dx_px.at(i, j)),
                 static_cast<double>(j) * motion.spacing_px + static_cast<double>(motion.dy_px.at(i, j))};
  };
  const Point origin = place(0, 0), right = place(last_column, 0), below = place(0, last_row);
  const double spacing = motion.spacing_px, width = last_column * spacing, height = last_row * spacing;
  return {origin,
          {(right.x - origin.x) / width, (right.y - origin.y) / width},
          {(below.x - origin.x) / height, (below.y - origin.y) / height}};
}

/// Returns the area of a quadrangle by its diagonals; its corners run around it.
double quadrangle_area(const Point& a, const Point& b, const Point& c, const Point& d) {
  return std::fabs((c.x - a.x) * (d.y - b.y) - (c.y - a.y) * (d.x - b.x)) / 2;
}

/// First and one beyond the last of up to `count` cells around one, within 0 .. cells.
struct CellRange {
  int first;
  int last;
  CellRange(int cell, int count, int cells)
      : first(std::clamp(cell - count / 2, 0, std::max(cells - count, 0))), last(std::min(first + count, cells)) {}
};

/// Returns the mean area of a pixel over up to count x count cells around one.
double cell_area(const InverseMotion& inverse, int column, int row, int count) {
  const CellRange h(column, count, inverse.columns), v(row, count, inverse.rows);
  const double pixels =
      static_cast<double>(h.last - h.first) * (v.last - v.first) * InverseMotion::cell_px * InverseMotion::cell_px;
  return quadrangle_area(inverse.node(h.first, v.first), inverse.node(h.last, v.first), inverse.node(h.last, v.last),
                         inverse.node(h.first, v.last)) /
         pixels;
}

}  // namespace

MotionInverse::MotionInverse(const Motion& motion) : motion_(motion) {
  const MappedPoint linear = linear_of(motion);
  origin_ = linear.at;
  by_x_ = linear.by_x;
  by_y_ = linear.by_y;
}

Point MotionInverse::at(const Point& frame) const {
  return invert(motion_, step_of({origin_, by_x_, by_y_}, frame.x - origin_.x, frame.y - origin_.y), frame);
}

InverseMotion inverse_of(const Motion& motion, int width, int height) {
  constexpr int cell = InverseMotion::cell_px;
  InverseMotion out{.columns = (width + cell - 1) / cell, .rows = (height + cell - 1) / cell};
  const MotionInverse inverse(motion);
  for (int j = 0; j <= out.rows; ++j) {
    for (int i = 0; i <= out.columns; ++i) {
      out.nodes.push_back(inverse.at({static_cast<double>(i) * cell, static_cast<double>(j) * cell}));
    }
  }
  for (int j = 0; j < out.rows; ++j) {
    for (int i = 0; i < out.columns; ++i) {
      const double wide = cell_area(out, i, j, 9);
      out.area.push_back(std::isnan(wide) ? cell_area(out, i, j, 1) : wide);
    }
  }
  return out;
}

}  // namespace lowlux::merge
