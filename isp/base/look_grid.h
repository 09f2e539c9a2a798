#pragma once

#include <array>
#include <cstdint>

#include "isp/base/plane.h"

namespace lowlux {

/// Returns the number of 4-pixel cells along a side of `pixels` pixels.
constexpr int cells_along(int pixels) { return (pixels + 3) / 4; }

/// Describes how a look changes linear RGB, on a grid with one cell for 4 x 4 pixels, interpolated linearly between the
/// cell centres. With v a pixel, Y = luminance . v, S = max(rods . v, min(min_rods Y, Y)) and the five components of
/// the grid at the pixel:
///     E   = Y + rod_fraction (S - Y)                               perceived luminance
///     out = (base + detail E) (1 + blue tint) + chroma (max(E, 0) + dark) / (max(Y, 0) + dark) (v - Y)
/// rod_fraction 0, chroma 1, blue 0, detail 1, base 0 leave v unchanged, up to rounding.
struct LookGrid {
  static constexpr int cell = 4;
  /// Gives the smallest S/P of any light, low-pressure sodium's 0.215, divided by that of D65. Linear weights make reds
  /// darker than that, and negative. Noise below black stays signed.
  static constexpr float min_rods = 0.215f / 2.46f;
  enum Part : std::uint8_t { rod_fraction, chroma, blue, detail, base };
  static constexpr int parts = 5;

  std::array<PlaneView<const float>, parts> part;  // ceil(height / 4) x ceil(width / 4), finite
  std::array<float, 3> luminance{};                // sum 1
  std::array<float, 3> rods{};                     // sum 1: relative to white
  std::array<float, 3> tint{};                     // luminance . tint = 0
  float dark = 1e-6f;                              // > 0: below it, chromaticity is held back, not amplified
};

}  // namespace lowlux
