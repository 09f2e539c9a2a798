#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "capture/synthetic/rigid_motion.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Differences between the frames of a burst. Frame 0 is never moved: its scene is the truth of a merged raw. All draws
/// are functions of a seed and of the number of the frame or object. Motions are those of the image: positive x is to
/// the right, positive y down, positive angles are clockwise.
struct BurstOptions {
  /// Hand shake: each frame is displaced by a draw of its own, uniform in a circle of this radius. 0..4096.
  double shake_px = 0;
  /// Each frame is rotated about the centre of the image by a draw of its own, uniform in +-roll_deg. 0..180.
  double roll_deg = 0;
  /// Dithering: frames are displaced evenly over a square of +-dither_px, by the Halton sequence of bases 2 and 3.
  /// 0..4096.
  double dither_px = 0;

  /// Rotation and displacement of the sky from one frame to the next, before the motion of the camera.
  double field_rotation_deg = 0;           // -180..180
  std::optional<ImagePoint> field_centre;  // centre of that rotation; absent: centre of the image
  double drift_x_px = 0, drift_y_px = 0;   // -4096..4096
  /// First row of the foreground in frame 0: it hides the sky and does not move with it. Absent: all is sky.
  std::optional<int> horizon_px;

  /// Square objects that move at constant speed in front of the scene: each shows another part of it, brighter or
  /// darker. They move with the foreground as the camera moves.
  int movers = 0;                       // 0..1000
  std::optional<double> mover_size_px;  // side; 1 to the shorter side of the image. Absent: an eighth of that
  double mover_speed_px = 8;            // per frame, 0..4096

  /// The exposure time of frame i is multiplied by 2^bracket_ev[i mod size]. -24..24 EV, at most 100; empty: all equal.
  std::vector<double> bracket_ev;

  /// Samples of the scene for each pixel of the sensor and axis, 1..8 (see LightGrid): the image is smaller than the
  /// scene by this factor. Absent: each sample is one pixel, without a lens, for bursts in which nothing moves.
  std::optional<int> reduction;

  /// Returns whether the sky moves from frame to frame.
  bool sky_moves() const { return field_rotation_deg != 0 || drift_x_px != 0 || drift_y_px != 0; }
  /// Returns whether anything moves from frame to frame.
  bool moves() const { return shake_px != 0 || roll_deg != 0 || dither_px != 0 || sky_moves() || movers != 0; }
};

/// Size of the image.
struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

/// Checks the options for an image. Errors: a value outside its range or not a number; motion or a horizon without a
/// reduction; a horizon outside of the image.
Result<void> check_burst(const BurstOptions& options, ImageSize size);

/// Returns where the camera's motion takes what is at a position of frame 0. The identity for frame 0.
RigidMotion camera_motion(const BurstOptions& options, ImageSize size, std::uint64_t seed, std::uint32_t frame);

/// Returns where the sky's own motion takes what is at a position of frame 0, as a camera at rest has it.
RigidMotion field_motion(const BurstOptions& options, ImageSize size, std::uint32_t frame);

/// Returns the exposure time of a frame in units of that of the options.
double exposure_factor(const BurstOptions& options, std::uint32_t frame);

/// A moving object: a square, upright in frame 0.
struct Mover {
  ImagePoint start;  // its centre in frame 0
  double x_px = 0;   // displacement from one frame to the next
  double y_px = 0;
  double side_px = 0;
  ImagePoint texture;  // centre of the part of frame 0 that it shows
  double gain = 1;     // factor on the radiance of that part

  ImagePoint centre(std::uint32_t frame) const { return {start.x_px + frame * x_px, start.y_px + frame * y_px}; }
  /// Returns its edges in the coordinates of frame 0.
  ImageBox box(std::uint32_t frame) const;
};

/// Returns the moving objects. In frame 0 each is entirely inside the image, and moves towards another place inside.
std::vector<Mover> movers_of(const BurstOptions& options, ImageSize size, std::uint64_t seed);

}  // namespace lowlux::capture
