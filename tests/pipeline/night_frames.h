#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "isp/base/frame.h"
#include "tests/denoise/frames.h"

/// Raw frames of known noise.
namespace lowlux::test {

inline constexpr double night_black_dn = 512, night_white_dn = 16383, night_gain_dn_per_e = 4;

inline double night_full_e() { return (night_white_dn - night_black_dn) / night_gain_dn_per_e; }

/// A frame of this scene, 512 DN black, 4 DN/e-, 14 bits, with the noise profile of the sensor. The neutral is
/// (0.5, 1, 0.625); colours are linear sRGB behind it.
inline RawFrame night_frame(const denoise_testing::Camera& camera, const denoise_testing::Scene& scene, int width,
                            int height, std::uint64_t seed = 1) {
  const Plane<float> charge_e = denoise_testing::exposed(camera, scene, width, height, seed);
  RawFrame frame;
  frame.raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dn = night_black_dn + night_gain_dn_per_e * static_cast<double>(charge_e.at(x, y));
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, night_white_dn)));
    }
  }
  frame.raw.phase = camera.phase;
  frame.raw.active = frame.raw.default_crop = {0, 0, width, height};
  frame.raw.black_tag = BlackLevel{.pattern_dn = {night_black_dn}};
  frame.raw.white_dn.fill(night_white_dn);
  const double scale = 1 / night_full_e();
  const double dn = 1.0 / 12 / (night_gain_dn_per_e * night_gain_dn_per_e);
  const double offset = (camera.read_noise_e * camera.read_noise_e + dn) * scale * scale;
  frame.noise = NoiseProfile{.scale = {scale, scale, scale}, .offset = {offset, offset, offset}};
  const Matrix3 xyz_to_srgb{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  frame.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = diagonal3({0.5, 1, 0.625}) * xyz_to_srgb}};
  frame.colour.as_shot_neutral = Vector3{0.5, 1, 0.625};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

}  // namespace lowlux::test
