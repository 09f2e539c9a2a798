#include "isp/render/hue_sat_map.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lowlux::isp {
namespace {

/// Locates a value on an axis: its lower and upper node, and the fraction of the way between them.
struct Place {
  std::size_t low = 0;
  std::size_t high = 0;
  float t = 0;
};

Place place_of(float fraction, int divisions) {
  if (divisions == 1) return {};
  const float x = std::clamp(fraction, 0.0f, 1.0f) * static_cast<float>(divisions - 1);
  const int low = std::min(static_cast<int>(x), divisions - 2);
  return {static_cast<std::size_t>(low), static_cast<std::size_t>(low) + 1, x - static_cast<float>(low)};
}

/// @param turn  hue as a fraction of the circle, 0..1
Place place_on_circle(float turn, int divisions) {
  const float x = turn * static_cast<float>(divisions);
  const int low = std::min(static_cast<int>(x), divisions - 1);
  return {static_cast<std::size_t>(low), static_cast<std::size_t>((low + 1) % divisions), x - static_cast<float>(low)};
}

using Change = std::array<float, 3>;

Change between(const Change& a, const Change& b, float t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

Change change_at(const HueSatMap& map, const Place& hue, const Place& saturation, const Place& value) {
  const auto node = [&](std::size_t v, std::size_t h, std::size_t s) {
    const std::size_t row = v * static_cast<std::size_t>(map.hues) + h;
    const float* const at = map.node.data() + 3 * (row * static_cast<std::size_t>(map.saturations) + s);
    return Change{at[0], at[1], at[2]};
  };
  const auto at_hue = [&](std::size_t v, std::size_t h) {
    return between(node(v, h, saturation.low), node(v, h, saturation.high), saturation.t);
  };
  const auto at_value = [&](std::size_t v) { return between(at_hue(v, hue.low), at_hue(v, hue.high), hue.t); };
  const Change low = at_value(value.low);
  return value.low == value.high ? low : between(low, at_value(value.high), value.t);
}

float encoded(float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f; }
float decoded(float c) { return c <= 0.0404500f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

/// Returns the hue of a colour that is not grey, in sixths of the circle, 0..6.
float hue_of(const float (&p)[3], float most, float range) {
  if (p[0] == most) {
    const float hue = (p[1] - p[2]) / range;
    return hue < 0 ? hue + 6 : hue;
  }
  return p[1] == most ? 2 + (p[2] - p[0]) / range : 4 + (p[0] - p[1]) / range;
}

}  // namespace

void apply_hue_sat_map(const HueSatMap& map, float (&rgb)[3]) {
  const float p[3] = {std::max(rgb[0], 0.0f), std::max(rgb[1], 0.0f), std::max(rgb[2], 0.0f)};
  const float most = std::max({p[0], p[1], p[2]}), range = most - std::min({p[0], p[1], p[2]});
  if (!(most > 0)) return;
  const bool encodes = map.srgb_encoded && map.values > 1;
  const float value = encodes ? encoded(most) : most;
  float hue = range > 0 ? hue_of(p, most, range) : 0;
  const Change change = change_at(map, place_on_circle(hue / 6, map.hues), place_of(range / most, map.saturations),
                                  place_of(value, map.values));
  hue += change[0] / 60;
  hue -= 6 * std::floor(hue / 6);
  const float scaled = encodes ? decoded(value * change[2]) : most * change[2];
  const float chroma = scaled * std::min(range / most * change[1], 1.0f);
  // Channel c is full where hue is within a sixth of its own, 2 c, and falls to 0 in the sixth beyond.
  for (int c = 0; c < 3; ++c) {
    const float away = std::fabs(hue - 2 * static_cast<float>(c));
    const float from_own = std::min(away, 6 - away);
    rgb[c] = scaled - chroma * std::clamp(from_own - 1, 0.0f, 1.0f) + std::min(rgb[c], 0.0f);
  }
}

}  // namespace lowlux::isp
