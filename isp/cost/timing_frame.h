#pragma once

#include <cstdint>

#include "isp/base/frame.h"

namespace lowlux::isp {

struct FrameSize {
  int width;
  int height;
};

/// Mean electrons of a pixel, in alternating blocks of 128 px, the tiles of the denoiser.
struct TimingLight {
  double one_e;
  double other_e;
};

/// Makes a raw frame for timing: waves of light and colour, with the noise of the camera's profile, and with edges in
/// every other block of 256 px, the first included. Denoising smooth frames is faster, except for Level::best, and
/// images contain smooth regions.
/// @param line_noise_e  standard deviation of the offset of each row, and of each column
/// @param index         number of the frame in a burst, whose frames differ in their noise
RawFrame timing_frame(const FrameSize& size, const TimingLight& light, double line_noise_e = 0,
                      std::uint32_t index = 0);

/// Returns a copy of a simulated frame: its codes, levels, colour and noise.
RawFrame copy_of(const RawFrame& frame);

}  // namespace lowlux::isp
