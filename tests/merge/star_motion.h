#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "isp/merge/stars/star_transform.h"
#include "tests/merge/star_scene.h"

/// True motions of a camera with a distorting lens.
namespace lowlux::star_testing {

using merge::Point;

/// Both frames are distorted by u -> u + k |u|^2 u about their centre; between, the sky is rotated about the centre,
/// scaled and displaced.
struct TrueMotion {
  double width = 0;
  double height = 0;
  double angle_rad = 0;
  double scale = 1;
  double dx = 0;
  double dy = 0;
  double corner_distortion_px = 0;

  Point centre() const { return {(width - 1) / 2, (height - 1) / 2}; }

  /// Returns where the lens shows a place of the undistorted frame.
  Point distorted(const Point& p) const {
    const Point c = centre();
    const double x = p.x - c.x, y = p.y - c.y, corner = std::hypot(c.x, c.y);
    const double k = corner_distortion_px / std::pow(corner, 3), square = x * x + y * y;
    return {p.x + k * square * x, p.y + k * square * y};
  }
  /// Returns where a place of the undistorted reference is in the undistorted frame.
  Point moved(const Point& p) const {
    const Point c = centre();
    const double x = p.x - c.x, y = p.y - c.y, cosine = scale * std::cos(angle_rad), sine = scale * std::sin(angle_rad);
    return {c.x + dx + cosine * x - sine * y, c.y + dy + sine * x + cosine * y};
  }
  bool in_view(const Point& p) const { return p.x >= 0 && p.y >= 0 && p.x <= width - 1 && p.y <= height - 1; }
};

inline TrueMotion drawn_motion(double width, double height, double corner_distortion_px, Draw& draw) {
  TrueMotion motion{.width = width, .height = height, .corner_distortion_px = corner_distortion_px};
  motion.angle_rad = std::exp(draw.uniform(std::log(0.1), std::log(180.0))) * std::numbers::pi / 180;
  if (draw.uniform() < 0.5) motion.angle_rad *= -1;
  motion.scale = 1 + draw.uniform(-0.015, 0.015);
  motion.dx = draw.uniform(-0.5, 0.5) * width;
  motion.dy = draw.uniform(-0.5, 0.5) * height;
  return motion;
}

/// Returns the transformation of a rotation about the centre, then a translation, without any uncertainty.
inline merge::StarTransform rotation(int width, int height, double degrees, double dx, double dy, double scale = 1) {
  const double angle = degrees * std::numbers::pi / 180, unit = width / 2.0 + 1;
  return {.centre = {(width - 1) / 2.0, (height - 1) / 2.0},
          .unit_px = unit,
          .coefficients = {scale * std::cos(angle), scale * std::sin(angle), dx / unit, dy / unit},
          .covariance = std::vector<double>(16, 0.0)};
}

}  // namespace lowlux::star_testing
