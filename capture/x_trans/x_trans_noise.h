#pragma once

#include "capture/x_trans/x_trans_pattern.h"
#include "isp/base/plane.h"

namespace lowlux::capture {

/// The variance of a value x: scale x + offset, both >= 0.
struct NoiseLine {
  double scale = 0;
  double offset = 0;
};

/// Estimates the noise of a mosaic from its blocks of 2 x 2 green sites: the difference of their diagonals has the
/// variance of a site where the scene is a plane, and the lower quartile of many of its amounts is that of smooth
/// regions. Texture makes the estimate too large, never too small.
/// @param mosaic  height x width, fractions of white; every 4th row of blocks of large mosaics is used
/// @return a line through the levels that occur; 0 and 0 for mosaics with fewer than 64 blocks
NoiseLine estimate_mosaic_noise(PlaneView<const float> mosaic, const XTransPhase& phase);

}  // namespace lowlux::capture
