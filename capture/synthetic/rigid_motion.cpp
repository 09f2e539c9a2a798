#include "capture/synthetic/rigid_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lowlux::capture {

double RigidMotion::rotation_deg() const { return std::atan2(sine, cosine) * 180 / std::numbers::pi; }

RigidMotion rigid_motion(ImagePoint centre, double rotation_deg, double dx_px, double dy_px) {
  if (rotation_deg == 0) return {1, 0, dx_px, dy_px};
  const double angle = rotation_deg * std::numbers::pi / 180;
  RigidMotion out{std::cos(angle), std::sin(angle), 0, 0};
  const ImagePoint turned = out.at(centre);
  out.x_px = centre.x_px - turned.x_px + dx_px;
  out.y_px = centre.y_px - turned.y_px + dy_px;
  return out;
}

RigidMotion inverse(const RigidMotion& motion) {
  RigidMotion out{motion.cosine, -motion.sine, 0, 0};
  const ImagePoint back = out.at({motion.x_px, motion.y_px});
  out.x_px = -back.x_px;
  out.y_px = -back.y_px;
  return out;
}

RigidMotion combined(const RigidMotion& first, const RigidMotion& second) {
  const ImagePoint shift = second.at({first.x_px, first.y_px});
  return {second.cosine * first.cosine - second.sine * first.sine,
          second.sine * first.cosine + second.cosine * first.sine, shift.x_px, shift.y_px};
}

ImageBox bounds_of(const RigidMotion& motion, const ImageBox& box) {
  const ImagePoint first = motion.at({box.left_px, box.top_px});
  ImageBox out{first.x_px, first.y_px, first.x_px, first.y_px};
  for (const ImagePoint corner :
       {ImagePoint{box.right_px, box.top_px}, {box.left_px, box.bottom_px}, {box.right_px, box.bottom_px}}) {
    const ImagePoint p = motion.at(corner);
    out.left_px = std::min(out.left_px, p.x_px);
    out.top_px = std::min(out.top_px, p.y_px);
    out.right_px = std::max(out.right_px, p.x_px);
    out.bottom_px = std::max(out.bottom_px, p.y_px);
  }
  return out;
}

}  // namespace lowlux::capture
