#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "isp/merge/stars/drizzle.h"
#include "tests/merge/star_motion.h"

namespace lowlux::star_testing {

inline merge::Motion moved(int width, int height, double degrees, double dx, double dy, double scale = 1) {
  return motion_of(rotation(width, height, degrees, dx, dy, scale), width, height);
}

inline Plane<float> constant(int width, int height, float value) {
  Plane<float> plane(width, height);
  std::fill_n(plane.data(), plane.size(), value);
  return plane;
}

inline merge::FrameView view(const Plane<float>& plane, BayerPhase phase = BayerPhase::rggb, double variance = 4) {
  return {plane.view(), phase, {variance, variance, variance, variance}};
}

/// Drizzles in double, one sample after another: for a translation and a rotation by a multiple of 90 degrees, where
/// the drop is the rotated pixel.
struct DrizzleReference {
  int width, height;
  std::array<std::vector<double>, 3> value, weight, squares;

  DrizzleReference(int output_width, int output_height) : width(output_width), height(output_height) {
    const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (auto* planes : {&value, &weight, &squares})
      for (std::vector<double>& plane : *planes) plane.assign(size, 0.0);
  }
  void add(const Plane<float>& frame, BayerPhase phase, int quarters, double dx, double dy,
           const merge::DrizzleOptions& options, double w) {
    const double cx = (frame.width() - 1) / 2.0, cy = (frame.height() - 1) / 2.0, half = options.pixfrac / 2;
    const std::array<double, 4> cosine{1, 0, -1, 0}, sine{0, 1, 0, -1};
    const double c = cosine[static_cast<std::size_t>(quarters)], s = sine[static_cast<std::size_t>(quarters)];
    for (int y = 0; y < frame.height(); ++y) {
      for (int x = 0; x < frame.width(); ++x) {
        if (std::isnan(frame.at(x, y))) continue;
        const double u = x - cx - dx, v = y - cy - dy, px = cx + c * u + s * v, py = cy - s * u + c * v;
        add_drop(static_cast<std::size_t>(colour_at(phase, x, y)), (px - half + 0.5) * options.scale,
                 (py - half + 0.5) * options.scale, options.pixfrac * options.scale, w,
                 static_cast<double>(frame.at(x, y)));
      }
    }
  }
  void add_drop(std::size_t colour, double left, double top, double side, double w, double y) {
    for (int j = 0; j < height; ++j) {
      const double overlap_y = std::min(top + side, j + 1.0) - std::max(top, static_cast<double>(j));
      for (int i = 0; i < width && overlap_y > 0; ++i) {
        const double overlap_x = std::min(left + side, i + 1.0) - std::max(left, static_cast<double>(i));
        if (overlap_x <= 0) continue;
        const double a = overlap_x * overlap_y / (side * side);
        const std::size_t k = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + i;
        value[colour][k] += a * w * y;
        weight[colour][k] += a * w;
        squares[colour][k] += a * a * w * w;
      }
    }
  }
};

}  // namespace lowlux::star_testing
