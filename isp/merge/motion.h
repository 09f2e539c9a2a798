#pragma once

#include <vector>

#include "isp/base/plane.h"

namespace lowlux::merge {

/// A place in a frame [px].
struct Point {
  double x = 0;
  double y = 0;
};

/// A displacement in pixels.
struct Shift {
  float dx_px = 0;
  float dy_px = 0;
};

/// Describes where the content of a reference frame lies in another frame: what is at (x, y) of the reference is at
/// (x, y) + at(x, y) in the frame. Node (column, row) stands at pixel (column * spacing_px, row * spacing_px); the
/// nodes reach to the far edges of the frame or beyond, and between them displacements are interpolated bilinearly.
struct Motion {
  int spacing_px = 32;
  Plane<float> dx_px;  // rows x columns of nodes
  Plane<float> dy_px;
  double standard_error_px = 0;  // standard error of a node, for each axis, as the noise model predicts it
  bool found = true;             // false: the frames do not determine a motion, and all displacements are 0

  /// Returns the displacement at a pixel of the reference; precondition: it lies within the nodes.
  Shift at(float x, float y) const;
};

/// Returns the largest displacement of a node, and the median: that of the camera, whatever moves in the scene.
double largest_shift_px(const Motion& motion);
double median_shift_px(const Motion& motion);

/// Returns a motion of displacement 0 for frames of width x height pixels.
Motion no_motion(int width, int height, int spacing_px = 32);

}  // namespace lowlux::merge
