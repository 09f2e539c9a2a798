#include "isp/cost/timing_frame.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double black_dn = 512, white_dn = 16383, dn_per_e = 4, read_noise_e = 1.5;

}  // namespace

RawFrame timing_frame(const FrameSize& size, const TimingLight& light, double line_noise_e, std::uint32_t index) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(size.width, size.height);
  std::vector<float> normal(static_cast<std::size_t>(size.width));
  const DrawStream stream{.seed = 8, .frame = index, .purpose = draw_purpose::electrons};
  for (int y = 0; y < size.height; ++y) {
    normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, normal);
    const double row_e = line_noise_e * std::sqrt(2) * std::sin(12.9898 * y);
    for (int x = 0; x < size.width; ++x) {
      const int c = static_cast<int>(colour_at(raw.phase, x, y));
      const double wave = std::sin(2 * std::numbers::pi * (x * (3.0 + c) / size.width + y * 2.0 / size.height));
      const bool smooth = (x / 256 + y / 256) % 2 != 0;
      const double texture = smooth ? 1 : ((x / 6) ^ (y / 6)) % 5 == 0 ? 1.6 : 0.9;
      const double mean_e = (x / 128 + y / 128) % 2 == 0 ? light.one_e : light.other_e;
      const double line_e = row_e + line_noise_e * std::sqrt(2) * std::sin(78.233 * x);
      const double e = mean_e * (1 + 0.3 * wave) * texture;
      const double noisy = e + line_e + std::sqrt(e + read_noise_e * read_noise_e) * static_cast<double>(normal[x]);
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(black_dn + dn_per_e * noisy, 0.0, white_dn)));
    }
  }
  raw.active = raw.default_crop = {0, 0, size.width, size.height};
  raw.black_tag = BlackLevel{.pattern_dn = {black_dn}};
  raw.white_dn.fill(white_dn);
  const double full_e = (white_dn - black_dn) / dn_per_e;
  NoiseProfile noise;
  noise.scale.fill(1 / full_e);
  noise.offset.fill((read_noise_e * read_noise_e + 1 / (12 * dn_per_e * dn_per_e)) / (full_e * full_e));
  frame.noise = noise;
  const Vector3 neutral{0.5, 1, 0.7};
  frame.colour.calibrations = {
      {.cct_k = 6504, .xyz_to_camera = diagonal3(neutral) * *xyz_to_output(OutputSpace::linear_srgb)}};
  frame.colour.as_shot_neutral = neutral;
  return frame;
}

RawFrame copy_of(const RawFrame& frame) {
  RawFrame out;
  out.raw.dn = frame.raw.dn.clone();
  out.raw.layout = frame.raw.layout;
  out.raw.phase = frame.raw.phase;
  out.raw.active = frame.raw.active;
  out.raw.default_crop = frame.raw.default_crop;
  out.raw.black_tag = frame.raw.black_tag;
  out.raw.white_dn = frame.raw.white_dn;
  out.raw.info = frame.raw.info;
  out.colour = frame.colour;
  out.noise = frame.noise;
  return out;
}

}  // namespace lowlux::isp
