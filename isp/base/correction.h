#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lowlux {

/// States the relative variance of measured gains, for example those of flat frames: shot * g + read * g^2 for a gain
/// g.
struct GainNoise {
  double shot = 0;
  double read = 0;
};

/// Holds a coarse grid of gains that spans part of the active area (DNG opcode GainMap, bilinear between its points).
struct GainMap {
  int top = 0, left = 0, bottom = 0, right = 0;  // the area it multiplies, in active pixels, ends excluded
  int row_pitch = 1, column_pitch = 1;  // it multiplies every row_pitch-th row and every column_pitch-th column
  int first_plane = 0, planes = 1;      // planes of linear_rgb data it multiplies
  int points_v = 1, points_h = 1, map_planes = 1;
  double spacing_v = 1, spacing_h = 1;  // distance of the points, relative to the active area's height and width
  double origin_v = 0, origin_h = 0;    // position of the first point, relative likewise
  std::vector<float> gain;              // points_v x points_h x map_planes; the last plane is that of all further ones
  std::array<GainNoise, 4> noise{};     // noise of each site of a mosaic; 0 where the gains are exact
};

/// Describes radial lens shading: gain 1 + k0 r^2 + k1 r^4 + ... + k4 r^10 (DNG opcode FixVignetteRadial), with r the
/// distance to the centre, relative to that of the farthest corner.
struct RadialGain {
  double k[5] = {};
  double centre_x = 0.5, centre_y = 0.5;  // relative to the active area
};

/// Marks a rectangle of pixels known to be defective, in active pixels; one pixel is 1x1.
struct DefectRect {
  int x = 0, y = 0, width = 1, height = 1;
};

/// Defect lists of more than 1 / max_named_fraction of the active pixels are rejected as implausible.
inline constexpr std::int64_t max_named_fraction = 16;

/// Holds an opcode of a DNG as the file states it.
struct DngOpcode {
  std::uint32_t id = 0;
  std::uint32_t version = 0;  // of DNG, which introduced it: 0x01030000 for 1.3
  std::uint32_t flags = 0;    // bit 0: readers may skip it; bit 1: previews may
  std::vector<std::byte> parameters;

  bool is_optional() const { return (flags & 1U) != 0; }
};

/// Holds the corrections a source asks for, each applied after black (and dark) have been subtracted.
struct RawCorrections {
  std::vector<GainMap> gain_maps;
  std::vector<RadialGain> radial_gains;
  std::vector<DefectRect> defects;
  std::array<std::vector<DngOpcode>, 2> not_applied;  // opcodes of OpcodeList2 and 3 for readers of a DNG of this frame
};

}  // namespace lowlux
