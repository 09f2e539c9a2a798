#pragma once

#include <span>
#include <vector>

#include "isp/model/colour/chromaticity_cloud.h"

namespace lowlux::isp {

/// Returns the corners of the convex hull of points, anticlockwise (Andrew's monotone chain, 1979); empty where the
/// points span no area. The points are finite.
std::vector<Xy> convex_hull(std::span<const Xy> points);

/// Returns the area of a polygon whose corners are anticlockwise; 0 for fewer than three.
double polygon_area(std::span<const Xy> corners);

/// Returns the area of the convex hull of points; 0 where they span none.
double hull_area(std::span<const Xy> points);

/// Returns the area of the intersection of two convex polygons, their corners anticlockwise: one is clipped by the
/// edges of the other (Sutherland and Hodgman 1974); 0 for fewer than three corners.
double shared_area(std::span<const Xy> first, std::span<const Xy> second);

}  // namespace lowlux::isp
