#include "isp/merge/stars/triangles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lowlux::merge {
namespace {

constexpr std::size_t neighbours = 8;
constexpr std::size_t max_points_for_all = 14;
constexpr double min_side_px = 8;
constexpr double min_height = 0.05;  // of the longest side

using Corners = std::array<int, 3>;

/// A triangle in one order of its corners: side i is opposite to corner i.
struct Triangle {
  Corners corners{};
  double longest_px = 0;  // side 0
  double ratio1 = 0;      // side 1 to side 0
  double ratio2 = 0;      // side 2 to side 0
  bool clockwise = false;
};

Triangle measured(const std::vector<Point>& points, const Corners& corners) {
  const auto corner = [&](int i) { return points[static_cast<std::size_t>(corners[static_cast<std::size_t>(i)])]; };
  const Point a = corner(0), b = corner(1), c = corner(2);
  const double side0 = std::hypot(b.x - c.x, b.y - c.y), side1 = std::hypot(c.x - a.x, c.y - a.y);
  const double side2 = std::hypot(a.x - b.x, a.y - b.y);
  const double cross = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  return {corners, side0, side1 / side0, side2 / side0, cross > 0};
}

/// Returns the triangle with its sides in falling order; a ratio of 0 if it is left out.
Triangle ordered(const std::vector<Point>& points, Corners corners) {
  const auto side = [&](std::size_t i) {
    const Point& p = points[static_cast<std::size_t>(corners[(i + 1) % 3])];
    const Point& q = points[static_cast<std::size_t>(corners[(i + 2) % 3])];
    return std::hypot(p.x - q.x, p.y - q.y);
  };
  std::array<std::pair<double, int>, 3> sides{{{side(0), corners[0]}, {side(1), corners[1]}, {side(2), corners[2]}}};
  std::sort(sides.begin(), sides.end(),
            [](const auto& p, const auto& q) { return p.first != q.first ? p.first > q.first : p.second < q.second; });
  if (sides[2].first < min_side_px) return {};
  Triangle out = measured(points, {sides[0].second, sides[1].second, sides[2].second});
  const double half = (1 + out.ratio1 + out.ratio2) / 2;  // Heron's formula, for a longest side of 1
  const double area = std::sqrt(std::max(half * (half - 1) * (half - out.ratio1) * (half - out.ratio2), 0.0));
  return 2 * area < min_height ? Triangle{} : out;
}

/// Returns the triples of points that make triangles, each once.
std::vector<Corners> triples(const std::vector<Point>& points) {
  std::vector<Corners> out;
  const std::size_t near = points.size() <= max_points_for_all ? points.size() : neighbours;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<std::pair<double, int>> others;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (k == i) continue;
      const double dx = points[k].x - points[i].x, dy = points[k].y - points[i].y;
      others.emplace_back(dx * dx + dy * dy, static_cast<int>(k));
    }
    const std::size_t count = std::min(near, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count), others.end());
    for (std::size_t p = 0; p < count; ++p) {
      for (std::size_t q = 0; q < p; ++q) {
        Corners corners{static_cast<int>(i), others[p].second, others[q].second};
        std::sort(corners.begin(), corners.end());
        out.push_back(corners);
      }
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<Triangle> triangles_of(const std::vector<Point>& points) {
  std::vector<Triangle> out;
  for (const Corners& corners : triples(points)) {
    const Triangle triangle = ordered(points, corners);
    if (triangle.ratio1 > 0) out.push_back(triangle);
  }
  return out;
}

/// Returns the orders of the corners in which no side is longer than the one before, up to the tolerance.
std::vector<Triangle> orders_of(const std::vector<Point>& points, const Triangle& triangle, double tolerance) {
  std::vector<Triangle> out;
  Corners order{0, 1, 2};
  do {
    Corners corners{};
    for (std::size_t i = 0; i < 3; ++i) corners[i] = triangle.corners[static_cast<std::size_t>(order[i])];
    const Triangle t = measured(points, corners);
    if (t.ratio1 <= 1 + tolerance && t.ratio2 <= t.ratio1 + tolerance) out.push_back(t);
  } while (std::next_permutation(order.begin(), order.end()));
  return out;
}

}  // namespace

std::vector<TrianglePair> matching_triangles(const std::vector<Point>& first, const std::vector<Point>& second,
                                             const TriangleOptions& options) {
  std::vector<Triangle> others = triangles_of(second);
  std::sort(others.begin(), others.end(), [](const Triangle& a, const Triangle& b) {
    return a.ratio1 != b.ratio1 ? a.ratio1 < b.ratio1 : a.corners < b.corners;
  });
  std::vector<TrianglePair> out;
  for (const Triangle& triangle : triangles_of(first)) {
    const double tolerance = options.tolerance + options.place_error_px / triangle.longest_px;
    for (const Triangle& t : orders_of(first, triangle, tolerance)) {
      auto other = std::lower_bound(others.begin(), others.end(), t.ratio1 - tolerance,
                                    [](const Triangle& a, double ratio) { return a.ratio1 < ratio; });
      for (; other != others.end() && other->ratio1 <= t.ratio1 + tolerance; ++other) {
        if (other->clockwise != t.clockwise || std::fabs(other->ratio2 - t.ratio2) > tolerance ||
            std::fabs(std::log(other->longest_px / t.longest_px)) > options.max_scale_change + tolerance)
          continue;
        out.push_back({t.corners, other->corners});
      }
    }
  }
  return out;
}

}  // namespace lowlux::merge
