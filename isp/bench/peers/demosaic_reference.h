#pragma once

#include <array>

#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/raw/kernel/raw_to_rgb.h"

/// Demosaicing in plain double, to measure the kernel by; borders are mirrored without repeating the edge.
namespace lowlux::isp {

/// R, G, B, of equal size.
using DoublePlanes = std::array<Plane<double>, 3>;

/// Each missing colour by the 5 x 5 filters of Malvar, He & Cutler (ICASSP 2004, figure 2).
/// @param in   at least 3 x 3 pixels, finite
/// @param out  as large
void demosaic_malvar(const SignedMosaic& in, DoublePlanes& out);

/// Each missing colour as the mean of its two or four nearest sites.
void demosaic_bilinear(const SignedMosaic& in, DoublePlanes& out);

/// A picture of 2 x 2 means at the size it was made from, linear between the middles of its pixels, which are not
/// beyond their outermost.
SceneLinear enlarged_twice(const RgbView<const float>& half, int width, int height);

}  // namespace lowlux::isp
