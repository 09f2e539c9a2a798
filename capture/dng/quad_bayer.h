#pragma once

#include <optional>
#include <span>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Describes a Quad Bayer mosaic: a Bayer mosaic of blocks, each of 2 x 2 sites of one colour.
struct QuadBayer {
  BayerPhase phase = BayerPhase::rggb;  // of the blocks, from the first complete one
  int x = 0, y = 0;  // corner of the first complete block, 0 or 1, from the corner of the active area
};

/// Returns the mosaic that has this pattern of 4 x 4 colours (0 red, 1 green, 2 blue; row after row, from the corner of
/// the active area); nullopt if it is not Quad Bayer.
std::optional<QuadBayer> quad_bayer_of(std::span<const double> pattern);

/// Bins a frame to a Bayer mosaic of half its width and height, as sensors do it for low light: a value is the sum of
/// the four sites of its block, black and white levels are four times those of a site, and the variance of the
/// NoiseProfile, of values 0..1, is a fourth. Codes stay codes where four times the white level fits in 16 bits, and
/// become floating-point samples otherwise. A block with a saturated site is saturated. Incomplete blocks at borders
/// are left out. Areas keep the blocks that are completely within them, named defects those that they touch. Gain maps,
/// which multiply all rows and columns of their area, keep their place in the scene.
/// Errors: an active area without a complete block (unsupported).
Result<void> bin_quad_bayer(const QuadBayer& mosaic, RawFrame& frame);

}  // namespace lowlux::capture
