#pragma once

#include "isp/base/frame.h"

namespace lowlux::isp {

struct FrameSize {
  int width;
  int height;
};

/// Mean electrons of a pixel, in squares of 128 px by turns: tiles of the denoiser.
struct TimingLight {
  double one_e;
  double other_e;
};

/// A raw whose time of developing is measured: waves of light and colour, as noisy as the camera says, with edges in
/// every other square of 256 px, the first among them. Denoising smooth frames is faster, but for Level::best, and of
/// pictures some parts are smooth.
/// @param line_noise_e  standard deviation of what each row has too much, and each column
RawFrame timing_frame(const FrameSize& size, const TimingLight& light, double line_noise_e = 0);

}  // namespace lowlux::isp
