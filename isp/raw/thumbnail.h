#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// A frame as means over square blocks, for the decisions that look at the whole picture.
struct Thumbnail {
  CameraRgb mean;              // block means, fraction of white, signed, not white balanced; at most 256 x 256
  double black_noise_std = 0;  // of one raw pixel without light, fraction of white; 0 if nothing tells
};

/// Block means of the active area, saturated samples included; sums are integers, so any thread count gives the same.
/// Noise of black pixels: measured on masked pixels, else sqrt(NoiseProfile offset), else estimated as the lowest
/// twentieth of the blocks' mean absolute difference of same-colour neighbours (times sqrt(pi) / 2, for a normal law);
/// blocks with clipped samples or without any difference do not count.
/// Gain maps are not applied: exposure and white balance do not need them.
Thumbnail make_thumbnail(const RawFrame& frame, const BlackPoint& black, Executor& executor);

}  // namespace lowlux::isp
