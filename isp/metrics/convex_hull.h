#pragma once

#include <span>
#include <vector>

#include "isp/model/colour/chromaticity_cloud.h"

namespace lowlux::isp {

/// Corners of the convex hull of points, anticlockwise (Andrew's monotone chain, 1979); empty where the points span no
/// area. The points are finite.
std::vector<Xy> convex_hull(std::span<const Xy> points);

/// Area of a polygon whose corners are anticlockwise; 0 for fewer than three.
double polygon_area(std::span<const Xy> corners);

/// Area of the convex hull of points; 0 where they span none.
double hull_area(std::span<const Xy> points);

/// Area that two convex polygons share, their corners anticlockwise: one is cut by the edges of the other (Sutherland
/// and Hodgman 1974); 0 for fewer than three corners.
double shared_area(std::span<const Xy> first, std::span<const Xy> second);

}  // namespace lowlux::isp
