#pragma once

#include <cstddef>
#include <vector>

namespace lowlux::isp {

/// Holds a table of a DNG profile that changes hue, saturation and value (DNG 1.6, ProfileHueSatMapData and
/// ProfileLookTableData). Its nodes lie at even steps: of hue around the circle, of saturation and value from 0 to 1.
struct HueSatMap {
  int hues = 1;
  int saturations = 2;
  int values = 1;             // 1: the changes do not depend on value
  bool srgb_encoded = false;  // value is looked up and scaled in the encoding of sRGB
  /// Holds the shift of hue [degrees], the factor of saturation and the factor of value of each node: for each
  /// saturation, within each hue, within each value.
  std::vector<float> node;
};

/// Tables have at most this many nodes and divisions.
inline constexpr std::size_t max_hue_sat_nodes = 1'000'000;
inline constexpr int max_hue_divisions = 360, max_saturation_divisions = 256, max_value_divisions = 256;

/// Changes one colour in linear ProPhoto RGB, in place. With p = max(rgb, 0) the result is
///     HSV^-1(h + shift, min(s saturation_factor, 1), v value_factor) + min(rgb, 0),    (h, s, v) = HSV(p),
/// the changes interpolated trilinearly between nodes. So noise below black stays signed. Values above 1 take the
/// changes of 1, and are not limited, since the tone curve compresses highlights.
void apply_hue_sat_map(const HueSatMap& map, float (&rgb)[3]);

}  // namespace lowlux::isp
