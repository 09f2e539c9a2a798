#include "tests/hard_cases/rec709_camera.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lowlux::hard_cases {
namespace {

double code_of(float value) { return std::round(rec709_range_dn * static_cast<double>(value)); }

}  // namespace

Rec709 in_codes(const Rec709& rgb) {
  Rec709 out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<float>(code_of(rgb[c]) / rec709_range_dn);
  return out;
}

RawFrame rec709_frame(int width, int height, const std::function<Rec709(int, int)>& rgb_at, const isp::Xyz& light) {
  RawFrame frame;
  frame.raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value = rgb_at(x, y)[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(rec709_black_dn + code_of(value));
    }
  }
  frame.raw.active = frame.raw.default_crop = {0, 0, width, height};
  frame.raw.black_tag = BlackLevel{.pattern_dn = {rec709_black_dn}};
  frame.raw.white_dn.fill(rec709_black_dn + rec709_range_dn);
  const Matrix3 xyz_to_rgb = *inverse(*isp::rgb_to_xyz(isp::primaries_rec709));
  frame.colour.calibrations = {
      {.cct_k = 6504, .xyz_to_camera = xyz_to_rgb * *isp::bradford_adaptation(*isp::xy_of(light), isp::white_d65)}};
  frame.colour.as_shot_neutral = Vector3{1, 1, 1};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

}  // namespace lowlux::hard_cases
