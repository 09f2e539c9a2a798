#pragma once

#include <memory>

#include "tests/denoise/mixed_frames.h"
#include "tests/pipeline/night_frames.h"

/// Raw frames that are a single frame in some blocks and a mean of several in the others.
namespace lowlux::test {

/// As night_frame, with its noise ratio: the noise profile is that of a single frame.
inline RawFrame mixed_night(const denoise_testing::Camera& camera, const denoise_testing::Scene& scene, int width,
                            int height, const denoise_testing::Blocks& blocks, std::uint64_t seed = 1) {
  RawFrame frame = night_frame(camera, scene, width, height, seed);
  denoise_testing::Mixed mixed = denoise_testing::mixed(camera, scene, width, height, 8, 8, blocks, seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dn = night_black_dn + night_gain_dn_per_e * static_cast<double>(mixed.both.at(x, y));
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, night_white_dn)));
    }
  }
  frame.noise_ratio = std::make_shared<const NoiseRatio>(std::move(mixed.ratio));
  return frame;
}

}  // namespace lowlux::test
