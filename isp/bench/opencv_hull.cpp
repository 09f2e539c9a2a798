#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "isp/bench/gamut_hull.h"

namespace lowlux::isp {
namespace {

using Corners = std::vector<cv::Point2f>;

Corners hull_of(const GamutPoints& points) {
  Corners all, hull;
  all.reserve(static_cast<std::size_t>(points.count));
  for (int i = 0; i < points.count; ++i) all.emplace_back(points.data[i].a, points.data[i].b);
  if (!all.empty()) cv::convexHull(all, hull);
  return hull;
}

double area_of(const Corners& hull) { return hull.size() < 3 ? 0.0 : cv::contourArea(hull); }

}  // namespace

bool lowlux_measure_hulls(const GamutPoints& reference, const GamutPoints& test, HullAreas* areas) noexcept {
  try {
    const Corners first = hull_of(reference), second = hull_of(test);
    HullAreas found{.reference = area_of(first), .test = area_of(second)};
    if (found.reference > 0 && found.test > 0) {
      Corners shared;
      found.both = static_cast<double>(cv::intersectConvexConvex(first, second, shared));
    }
    *areas = found;
    return true;
  } catch (...) {
    return false;  // out of memory, or a case OpenCV's checks refuse
  }
}

}  // namespace lowlux::isp
