#pragma once

#include <cstdint>
#include <span>

#include "capture/synthetic/burst_motion.h"
#include "capture/synthetic/light_grid.h"
#include "capture/synthetic/rigid_motion.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"

namespace lowlux::capture {

/// The extended light of a scene as one frame of a burst has it: the sky, in front of it the foreground, in front of
/// both the moving objects. Pixels at an edge between two of them mix their means by the area that each covers.
struct BurstView {
  const LightGrid& sky;
  const LightGrid* foreground = nullptr;  // null: all is sky
  double horizon_px = 0;                  // first row of the foreground
  RigidMotion sky_motion;                 // from frame 0 to this frame
  RigidMotion camera_motion;              // of the foreground and the moving objects
  std::span<const Mover> movers;          // later ones are in front
  std::uint32_t frame = 0;
};

/// Renders the means under each pixel's own filter.
void render_mosaic(const BurstView& view, BayerPhase phase, Executor& executor, Plane<float>& out);

/// Renders the means of three channels at every pixel.
void render_planes(const BurstView& view, Executor& executor, const RgbView<float>& out);

}  // namespace lowlux::capture
