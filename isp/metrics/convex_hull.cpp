#include "isp/metrics/convex_hull.h"

#include <algorithm>

namespace lowlux::isp {
namespace {

/// Returns twice the area of the triangle o, a, b; positive if it turns left.
double turn(const Xy& o, const Xy& a, const Xy& b) { return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x); }

/// Adds one chain of the hull over sorted points; its last point is left to the other chain.
void add_chain(std::span<const Xy> points, std::vector<Xy>& hull) {
  const std::size_t start = hull.size();
  for (const Xy& p : points) {
    while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  }
  hull.pop_back();
}

/// Returns the part of a polygon that lies left of the line from `a` to `b`.
std::vector<Xy> left_part(std::span<const Xy> polygon, const Xy& a, const Xy& b) {
  std::vector<Xy> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Xy p = polygon[i], q = polygon[(i + 1) % polygon.size()];
    const double side_p = turn(a, b, p), side_q = turn(a, b, q);
    if (side_p >= 0) out.push_back(p);
    if ((side_p > 0 && side_q < 0) || (side_p < 0 && side_q > 0)) {
      const double t = side_p / (side_p - side_q);
      out.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
    }
  }
  return out;
}

}  // namespace

std::vector<Xy> convex_hull(std::span<const Xy> points) {
  if (points.size() < 3) return {};
  std::vector<Xy> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const Xy& a, const Xy& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Xy> hull;
  add_chain(sorted, hull);
  std::reverse(sorted.begin(), sorted.end());
  add_chain(sorted, hull);
  if (hull.size() < 3) hull.clear();
  return hull;
}

double polygon_area(std::span<const Xy> corners) {
  double area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    area += 0.5 * turn({}, corners[i], corners[(i + 1) % corners.size()]);
  return area;
}

double hull_area(std::span<const Xy> points) { return polygon_area(convex_hull(points)); }

double shared_area(std::span<const Xy> first, std::span<const Xy> second) {
  if (first.size() < 3 || second.size() < 3) return 0;
  std::vector<Xy> rest(first.begin(), first.end());
  for (std::size_t i = 0; i < second.size() && !rest.empty(); ++i) {
    rest = left_part(rest, second[i], second[(i + 1) % second.size()]);
  }
  return polygon_area(rest);
}

}  // namespace lowlux::isp
