#pragma once

#include <cstdint>

#include "isp/base/frame.h"

namespace lowlux::test {

/// Returns a frame whose samples differ from their neighbours and use both ends of the range; the entire readout is
/// active, black 256 is tagged, white 65535; one matrix (D65) and a neutral unless it is monochrome.
inline RawFrame plain_frame(int width, int height, SensorLayout layout = SensorLayout::bayer,
                            BayerPhase phase = BayerPhase::rggb) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  const int samples = layout == SensorLayout::linear_rgb ? 3 : 1;
  raw.dn = Plane<std::uint16_t>(samples * width, height);
  for (std::size_t i = 0; i < raw.dn.size(); ++i) raw.dn.data()[i] = static_cast<std::uint16_t>(i * 40503U ^ i >> 3);
  raw.layout = layout;
  raw.phase = phase;
  raw.active = raw.default_crop = {0, 0, width, height};
  BlackLevel black;
  black.samples = samples;
  black.pattern_dn.assign(samples, 256.0);
  raw.black_tag = black;
  raw.white_dn = {65535, 65535, 65535};
  raw.info.make = "Maker";
  raw.info.model = "Model 1";
  if (layout == SensorLayout::monochrome) return frame;
  ColourCalibration day;
  day.cct_k = 6504;
  day.xyz_to_camera = {{{0.8, -0.2, -0.1}, {-0.4, 1.2, 0.2}, {-0.1, 0.2, 0.6}}};
  frame.colour.calibrations = {day};
  frame.colour.as_shot_neutral = Vector3{0.5, 1, 0.6};
  return frame;
}

}  // namespace lowlux::test
