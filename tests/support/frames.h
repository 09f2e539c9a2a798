#pragma once

#include <functional>
#include <random>

#include "isp/base/frame.h"

namespace lowlux::test {

/// Returns a Bayer frame whose entire readout is active: black 0 is tagged, white 4095.
inline RawDn bayer_frame(int width, int height, BayerPhase phase, const std::function<int(int, int)>& dn_at) {
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) raw.dn.at(x, y) = static_cast<std::uint16_t>(dn_at(x, y));
  }
  raw.phase = phase;
  raw.active = {0, 0, width, height};
  raw.default_crop = raw.active;
  raw.black_tag = BlackLevel{.pattern_dn = {0.0}};
  raw.white_dn = {4095, 4095, 4095};
  return raw;
}

/// Draws rounded normal deviates from a fixed seed.
class NormalDn {
 public:
  explicit NormalDn(unsigned seed) : engine_(seed) {}
  int operator()(double mean, double std) {
    const double v = mean + std * normal_(engine_);
    return v < 0 ? 0 : static_cast<int>(std::lround(v));
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace lowlux::test
