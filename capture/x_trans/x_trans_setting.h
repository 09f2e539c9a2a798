#pragma once

#include <array>

#include "capture/x_trans/x_trans_pattern.h"

namespace lowlux::capture {

/// States what the interpolation has to know of a mosaic. Values are fractions of white.
struct XTransSetting {
  XTransPhase phase{};
  std::array<double, 3> neutral{1, 1, 1};  // R, G, B of a neutral; any scale, > 0
  double noise_scale = 0;                  // the variance of a value x is noise_scale x + noise_offset, both >= 0
  double noise_offset = 0;
};

}  // namespace lowlux::capture
