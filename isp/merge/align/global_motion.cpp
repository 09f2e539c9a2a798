#include "isp/merge/align/global_motion.h"

#include <cmath>

namespace lowlux::merge {

GlobalMotion::GlobalMotion(int width, int height)
    : centre_x_((width - 1) / 2.0), centre_y_((height - 1) / 2.0), radius_px_(std::hypot(width, height) / 2) {}

GlobalMotion::GlobalMotion(int width, int height, Shift shift, double turn_rad) : GlobalMotion(width, height) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  h_ = {{{c, -s, shift.dx_px / radius_px_}, {s, c, shift.dy_px / radius_px_}, {0, 0, 1}}};
}

Shift GlobalMotion::at(double x, double y) const {
  const Vector3 from{(x - centre_x_) / radius_px_, (y - centre_y_) / radius_px_, 1};
  const Vector3 to = h_ * from;
  return {static_cast<float>(radius_px_ * (to[0] / to[2] - from[0])),
          static_cast<float>(radius_px_ * (to[1] / to[2] - from[1]))};
}

std::array<MotionStep, 2> GlobalMotion::slopes_at(double x, double y) const {
  const double u = (x - centre_x_) / radius_px_, v = (y - centre_y_) / radius_px_;
  return {{{1, 0, -v, u, u, v, u * u, u * v}, {0, 1, u, v, -v, u, u * v, v * v}}};
}

void GlobalMotion::add(const MotionStep& step) {
  MotionStep p = step;
  for (double& value : p) value /= radius_px_;
  const double c = std::cos(p[2]), s = std::sin(p[2]);
  const Matrix3 turn{{{c, -s, p[0]}, {s, c, p[1]}, {0, 0, 1}}};
  const Matrix3 stretch{{{1 + p[3] + p[4], p[5], 0}, {p[5], 1 + p[3] - p[4], 0}, {-p[6], -p[7], 1}}};
  h_ = h_ * (turn * stretch);
  for (int i = 0; i < motion_parameters; ++i) total_[i] += step[i];
}

Shift GlobalMotion::shift() const { return at(centre_x_, centre_y_); }

double GlobalMotion::turn_rad() const { return std::atan2(h_[1][0] - h_[0][1], h_[0][0] + h_[1][1]); }

}  // namespace lowlux::merge
