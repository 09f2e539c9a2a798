#include "tests/support/chart_photograph.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <random>

namespace lowlux::test {
namespace {

constexpr double patch_width = 0.86;  // fraction of a cell

/// Maps a plane's (u, v) to the frame, and back.
struct Projection {
  Matrix3 to_frame;
  Matrix3 to_plane;
};

Projection projection_of(const ChartPhotograph& p) {
  const double angle = p.angle_deg * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
  const double flip = p.mirrored ? -1 : 1;
  const Matrix3 centred{{{flip, 0, -3 * flip}, {0, 1, -2}, {0, 0, 1}}};
  const Matrix3 tilted{{{1, 0, 0}, {0, 1, 0}, {0, -p.keystone / 4, 1}}};
  const Matrix3 placed{
      {{p.cell_px * c, -p.cell_px * s, p.centre_x}, {p.cell_px * s, p.cell_px * c, p.centre_y}, {0, 0, 1}}};
  const Matrix3 to_frame = placed * tilted * centred;
  return {to_frame, *inverse(to_frame)};
}

std::array<double, 2> project(const Matrix3& m, double x, double y) {
  const Vector3 p = m * Vector3{x, y, 1};
  return {p[0] / p[2], p[1] / p[2]};
}

/// Returns the camera RGB at a point of the plane; nullopt outside the chart.
std::optional<Vector3> colour_of(double u, double v, const std::array<Vector3, 24>& camera_rgb) {
  constexpr double border = 0.25;
  if (u < -border || v < -border || u > 6 + border || v > 4 + border) return std::nullopt;
  const double column = std::floor(u), row = std::floor(v);
  const bool patch = column >= 0 && column < 6 && row >= 0 && row < 4 &&
                     std::fabs(u - column - 0.5) < patch_width / 2 && std::fabs(v - row - 0.5) < patch_width / 2;
  if (!patch) return Vector3{0.01, 0.01, 0.01};
  return camera_rgb[static_cast<std::size_t>(row) * 6 + static_cast<std::size_t>(column)];
}

}  // namespace

std::array<double, 2> chart_point(const ChartPhotograph& photograph, double u, double v) {
  return project(projection_of(photograph).to_frame, u, v);
}

void add_patches(const ChartPhotograph& p, const std::array<Vector3, 24>& camera_rgb, RawFrame& frame) {
  const Projection projection = projection_of(p);
  std::mt19937 engine(p.seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      const auto [u, v] = project(projection.to_plane, x, y);
      const auto rgb = colour_of(u, v, camera_rgb);
      if (!rgb) continue;
      const double light = 1 + p.light_x * (u / 3 - 1) + p.light_y * (v / 2 - 1);
      const double range = photograph_white_dn - photograph_black_dn;
      const double mean =
          p.exposure * light * range * (*rgb)[static_cast<std::size_t>(colour_at(frame.raw.phase, x, y))];
      const double deviation = std::sqrt(p.read_noise_dn * p.read_noise_dn + std::max(0.0, mean) / p.electrons_per_dn);
      const double dn = photograph_black_dn + mean + deviation * normal(engine);
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, photograph_white_dn));
    }
  }
}

RawFrame photograph_patches(const ChartPhotograph& p, const std::array<Vector3, 24>& camera_rgb) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(p.width, p.height);
  raw.active = raw.default_crop = {0, 0, p.width, p.height};
  raw.black_tag = BlackLevel{.pattern_dn = {photograph_black_dn}};
  raw.white_dn = {photograph_white_dn, photograph_white_dn, photograph_white_dn};
  raw.info.make = "Maker";
  raw.info.model = "Model 1";
  const double wall = photograph_black_dn + 0.3 * p.exposure * (photograph_white_dn - photograph_black_dn);
  std::fill_n(raw.dn.data(), raw.dn.size(), static_cast<std::uint16_t>(std::clamp(wall, 0.0, photograph_white_dn)));
  add_patches(p, camera_rgb, frame);
  return frame;
}

}  // namespace lowlux::test
