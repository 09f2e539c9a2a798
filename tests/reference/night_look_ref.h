#pragma once

#include <array>
#include <vector>

#include "isp/base/image.h"
#include "isp/render/night/night_look.h"

/// These functions compute what isp/render/night/night_look.h promises, in double and without tables: CIE 191 solved
/// for every cell.
namespace lowlux::reference {

/// Holds a plane in double, row by row; positions beyond its ends count as the nearest inside.
struct Field {
  int width = 0;
  int height = 0;
  std::vector<double> value;

  Field(int w, int h) : width(w), height(h), value(static_cast<std::size_t>(w) * h) {}
  double& at(int x, int y) { return value[static_cast<std::size_t>(y) * width + x]; }
  double clamped(int x, int y) const;
};

/// Returns the five parts of LookGrid, without glare and without a limit of noise.
std::vector<Field> night_look(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                              const isp::NightLook& look);

/// Returns the parts in float, as LookGrid has them.
/// @param memory  keeps them
LookGrid look_grid(const std::vector<Field>& parts, const isp::NightLook& look, std::vector<Plane<float>>& memory);

}  // namespace lowlux::reference
