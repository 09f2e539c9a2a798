#pragma once

#include <algorithm>
#include <cstddef>

#include "isp/base/correction.h"

namespace lowlux {

/// Holds a pixel's position on the grid of a map: the point before it, the point after it and the weight of the latter.
struct GridPosition {
  int before;
  int after;
  float weight;
};

/// Returns the position of a row or column whose centre is at `relative` of the height or width of the image. Outside
/// of the points it is that of the nearest (DNG 1.7, GainMap).
inline GridPosition grid_position(double relative, double origin, double spacing, int points) {
  const double at = points > 1 && spacing > 0 ? std::clamp((relative - origin) / spacing, 0.0, points - 1.0) : 0.0;
  const int before = static_cast<int>(at);
  return {before, std::min(before + 1, points - 1), static_cast<float>(at - before)};
}

inline GridPosition row_position(const GainMap& map, int y, int height) {
  return grid_position((y + 0.5) / height, map.origin_v, map.spacing_v, map.points_v);
}

inline GridPosition column_position(const GainMap& map, int x, int width) {
  return grid_position((x + 0.5) / width, map.origin_h, map.spacing_h, map.points_h);
}

/// Returns the value of a map between its points, bilinear, for a plane of the image. The last plane of the map is that
/// of all further planes of the image.
inline float gain_at(const GainMap& map, const GridPosition& v, const GridPosition& h, int plane) {
  const int map_plane = std::min(plane, map.map_planes - 1);
  const auto point = [&](int row, int column) {
    return map.gain[(static_cast<std::size_t>(row) * map.points_h + column) * map.map_planes + map_plane];
  };
  const float top = point(v.before, h.before) * (1 - h.weight) + point(v.before, h.after) * h.weight;
  const float bottom = point(v.after, h.before) * (1 - h.weight) + point(v.after, h.after) * h.weight;
  return top * (1 - v.weight) + bottom * v.weight;
}

/// Evaluates a radial gain in an image of some size.
class RadialGainAt {
 public:
  RadialGainAt(const RadialGain& gain, int width, int height)
      : gain_(gain), centre_x_(gain.centre_x * (width - 1)), centre_y_(gain.centre_y * (height - 1)) {
    const double far_x = std::max(centre_x_, width - 1 - centre_x_);
    const double far_y = std::max(centre_y_, height - 1 - centre_y_);
    far2_ = std::max(far_x * far_x + far_y * far_y, 1e-12);
  }

  double operator()(int x, int y) const {
    const double dx = x - centre_x_, dy = y - centre_y_;
    const double r2 = (dx * dx + dy * dy) / far2_;
    const double* k = gain_.k;
    return 1 + r2 * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * (k[3] + r2 * k[4]))));
  }

 private:
  RadialGain gain_;
  double centre_x_, centre_y_;
  double far2_ = 1;
};

}  // namespace lowlux
