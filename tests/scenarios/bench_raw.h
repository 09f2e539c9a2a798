#pragma once

#include <cstdint>

#include "isp/base/frame.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// What a sensor does beside the noise that a denoiser knows of.
struct SensorFlaws {
  double row_noise_e = 0;         // standard deviation of each row's offset
  double column_noise_e = 0;      // of each column's
  double hot_pixel_fraction = 0;  // of all pixels
  double hot_pixel_e = 0;         // mean of their extra charge, exponentially distributed
};

/// A raw file as a camera would write it.
struct BenchRaw {
  RawFrame frame;                    // its black tag holds pedestal and dark charge
  BlackPoint black;                  // pedestal and dark charge apart, as a profile has them
  NoiseProfile noise_over_pedestal;  // for `black`
};

/// Codes of a shot: RGGB, white gains as in denoise_scene.h, saturated two stops above display white, colours of linear
/// Rec. 709, a noise profile that holds but for the flaws. Equal input, equal codes.
BenchRaw raw_of(const DenoiseShot& shot, const SensorFlaws& flaws, std::uint64_t seed);

}  // namespace lowlux::isp
