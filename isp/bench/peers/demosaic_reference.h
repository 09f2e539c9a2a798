#pragma once

#include <array>

#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/raw/kernel/raw_to_rgb.h"

/// Demosaicing in plain double is the reference of the kernel; borders are mirrored without repeating the edge.
namespace lowlux::isp {

/// Planes R, G, B, of equal size.
using DoublePlanes = std::array<Plane<double>, 3>;

/// Interpolates each missing colour by the 5 x 5 filters of Malvar, He & Cutler (ICASSP 2004, figure 2).
/// @param in   at least 3 x 3 pixels, finite
/// @param out  out of the same size
void demosaic_malvar(const SignedMosaic& in, DoublePlanes& out);

/// Interpolates each missing colour as the mean of its two or four nearest sites.
void demosaic_bilinear(const SignedMosaic& in, DoublePlanes& out);

/// Enlarges an image of 2 x 2 means to its original size, linearly between the centres of its pixels; beyond the
/// outermost centres it is constant.
SceneLinear enlarged_twice(const RgbView<const float>& half, int width, int height);

}  // namespace lowlux::isp
