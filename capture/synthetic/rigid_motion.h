#pragma once

namespace lowlux::capture {

/// A position in an image; integers are centres of pixels.
struct ImagePoint {
  double x_px = 0;
  double y_px = 0;
};

/// The edges of an upright box in an image. Pixel x covers x - 0.5 to x + 0.5.
struct ImageBox {
  double left_px = 0;
  double top_px = 0;
  double right_px = 0;
  double bottom_px = 0;
};

/// A rotation and a displacement in the plane of the image. The default moves nothing.
///     x' = cosine x - sine y + x_px
///     y' = sine x + cosine y + y_px
/// y points down, so that positive angles turn clockwise as seen by the viewer.
struct RigidMotion {
  double cosine = 1;
  double sine = 0;
  double x_px = 0;
  double y_px = 0;

  ImagePoint at(ImagePoint p) const {
    return {cosine * p.x_px - sine * p.y_px + x_px, sine * p.x_px + cosine * p.y_px + y_px};
  }
  double rotation_deg() const;  // -180..180
};

/// Returns the rotation about a centre, followed by a displacement of (dx_px, dy_px). A rotation of 0 is exact: it
/// displaces every position by the same two numbers.
RigidMotion rigid_motion(ImagePoint centre, double rotation_deg, double dx_px, double dy_px);

/// Returns the motion back.
RigidMotion inverse(const RigidMotion& motion);

/// Returns the motion `first`, followed by `second`.
RigidMotion combined(const RigidMotion& first, const RigidMotion& second);

/// Returns the smallest upright box around a moved box.
ImageBox bounds_of(const RigidMotion& motion, const ImageBox& box);

}  // namespace lowlux::capture
