#include "tests/reference/hue_sat_map_ref.h"

#include <algorithm>
#include <cmath>

namespace lowlux::reference {
namespace {

double srgb(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }
double linear(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }

/// Returns the hat of node i at x, both in steps of an axis.
double hat(double x, double i) { return std::max(0.0, 1 - std::fabs(x - i)); }

/// Adds up all nodes, each weighted by the product of its hats.
Vector3 change_at(const isp::HueSatMap& map, double hue_deg, double saturation, double value) {
  const double h = hue_deg / 360 * map.hues, s = saturation * (map.saturations - 1), v = value * (map.values - 1);
  Vector3 out{};
  std::size_t at = 0;
  for (int k = 0; k < map.values; ++k) {
    for (int j = 0; j < map.hues; ++j) {
      for (int i = 0; i < map.saturations; ++i, at += 3) {
        const double on_circle = map.hues == 1 ? 1 : hat(h, j) + hat(h, j + map.hues);
        const double weight = on_circle * hat(s, i) * hat(v, k);
        for (std::size_t c = 0; c < 3; ++c) out[c] += weight * map.node[at + c];
      }
    }
  }
  return out;
}

double hue_deg_of(const Vector3& p) {
  // The angle of the hexagon: each of its sides is 60 degrees, whatever the angle of its projection.
  const double most = std::max({p[0], p[1], p[2]}), range = most - std::min({p[0], p[1], p[2]});
  if (range == 0) return 0;
  if (most == p[0]) return std::fmod(360 + 60 * (p[1] - p[2]) / range, 360);
  return most == p[1] ? 120 + 60 * (p[2] - p[0]) / range : 240 + 60 * (p[0] - p[1]) / range;
}

}  // namespace

Vector3 through_hue_sat_map(const isp::HueSatMap& map, const Vector3& rgb) {
  Vector3 p{};
  for (std::size_t c = 0; c < 3; ++c) p[c] = std::max(rgb[c], 0.0);
  const double most = std::max({p[0], p[1], p[2]});
  if (most == 0) return rgb;
  const double saturation = 1 - std::min({p[0], p[1], p[2]}) / most;
  const bool encodes = map.srgb_encoded && map.values > 1;
  const double value = encodes ? srgb(most) : most;
  const Vector3 change = change_at(map, hue_deg_of(p), saturation, std::min(value, 1.0));
  const double v = encodes ? linear(value * change[2]) : value * change[2];
  const double s = std::min(saturation * change[1], 1.0);
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    // The formula of HSV to RGB without cases: k turns from 0 to 6, and is 5, 3 and 1 at red for R, G and B.
    const double turn = std::fmod(720 + std::fmod(hue_deg_of(p) + change[0], 360), 360) / 60;
    const double k = std::fmod(5 - 2 * static_cast<double>(c) + turn + 6, 6);
    out[c] = v - v * s * std::clamp(std::min(k, 4 - k), 0.0, 1.0) + std::min(rgb[c], 0.0);
  }
  return out;
}

}  // namespace lowlux::reference
