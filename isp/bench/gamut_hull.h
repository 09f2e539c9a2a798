#pragma once

namespace lowlux::isp {

/// A place in the plane of CIELAB a* and b*.
struct GamutPoint {
  float a = 0;
  float b = 0;
};

/// Points of one picture, borrowed.
struct GamutPoints {
  const GamutPoint* data = nullptr;
  int count = 0;
};

/// Areas of the convex hulls of two sets of points and of what both hulls cover. Of fewer than three points, and of
/// points on one line, a hull has none.
struct HullAreas {
  double reference = 0;
  double test = 0;
  double both = 0;
};

/// What liblowlux_hull.so gives. OpenCV stands behind this type, as calib/chart_detector.h says of its own: who does
/// not compare pictures need not load it. The points are finite. @return whether it worked; if not, `areas` is as it
/// was
using MeasureHulls = bool(const GamutPoints& reference, const GamutPoints& test, HullAreas* areas) noexcept;

/// The name under which the module holds it.
inline constexpr const char* measure_hulls_name = "lowlux_measure_hulls";

/// OpenCV's convexHull (Sklansky 1982) and intersectConvexConvex (O'Rourke et al. 1982), in single precision: areas are
/// good to 1e-5 of the larger hull.
extern "C" MeasureHulls lowlux_measure_hulls;

}  // namespace lowlux::isp
