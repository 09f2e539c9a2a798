#pragma once

#include "isp/base/matrix3.h"
#include "isp/merge/align/small_matrix.h"
#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Parameters of a small change of a homography, each in pixels at the corner of a frame: translation x, y; rotation;
/// scale; two of shear; two of perspective.
inline constexpr int rigid_parameters = 3;
inline constexpr int motion_parameters = 8;
using MotionStep = SmallVector<motion_parameters>;

/// A homography of the pixels of a frame: what a rotation of the camera does to an ideal image of any scene.
/// Coordinates are relative to the centre of the frame, in units of half its diagonal.
class GlobalMotion {
 public:
  GlobalMotion(int width, int height);
  /// @param turn_rad  rotation about the centre of the frame; from x to y where positive
  GlobalMotion(int width, int height, Shift shift, double turn_rad);

  /// Returns the displacement of pixel (x, y).
  Shift at(double x, double y) const;

  /// Returns the displacement of pixel (x, y) for each parameter of a step [px / px], x component first.
  std::array<MotionStep, 2> slopes_at(double x, double y) const;

  /// Composes the motion with a step: at() changes by slopes_at() times the step, to first order.
  void add(const MotionStep& step);

  /// Returns the sum of the steps since construction, of which the prior of a fit depends.
  const MotionStep& total() const { return total_; }
  double radius_px() const { return radius_px_; }
  /// Returns the displacement of the centre, and the rotation there.
  Shift shift() const;
  double turn_rad() const;

 private:
  double centre_x_;
  double centre_y_;
  double radius_px_;
  Matrix3 h_ = identity3();
  MotionStep total_{};
};

}  // namespace lowlux::merge
