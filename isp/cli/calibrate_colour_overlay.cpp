#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isp/cli/calibrate_colour_report.h"

namespace lowlux::cli {
namespace {

using Colour = std::array<std::uint8_t, 3>;

void draw(Encoded8& picture, const calib::PicturePoint& from, const calib::PicturePoint& to, const Colour& colour) {
  const int steps = static_cast<int>(std::ceil(std::max(std::fabs(to.x - from.x), std::fabs(to.y - from.y)))) + 1;
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    const auto x = std::lround(from.x + t * (to.x - from.x)), y = std::lround(from.y + t * (to.y - from.y));
    if (x < 0 || y < 0 || x >= picture.width() || y >= picture.height()) continue;
    std::copy(colour.begin(), colour.end(), picture.codes.row(static_cast<int>(y)) + 3 * x);
  }
}

/// The brightest channel of the chart's brightest patch, white balanced: it becomes nearly white in the picture.
double white_of(const MeasuredChart& chart) {
  double brightest = 0;
  for (const calib::ChartPatch& patch : chart.found.patches) {
    for (std::size_t c = 0; c < 3; ++c) brightest = std::max(brightest, patch.camera_rgb[c] / chart.neutral[c]);
  }
  return brightest > 0 ? brightest / 0.9 : 1;
}

}  // namespace

Encoded8 colour_overlay(const MeasuredChart& chart) {
  constexpr Colour outline{255, 255, 0}, first{255, 0, 0};
  const CameraRgb& rgb = chart.picture.rgb;
  Encoded8 out{Plane<std::uint8_t>(3 * rgb.width(), rgb.height())};
  const double white = white_of(chart);
  for (int y = 0; y < rgb.height(); ++y) {
    for (int x = 0; x < rgb.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = std::clamp(rgb.plane[c].at(x, y) / (chart.neutral[c] * white), 0.0, 1.0);
        out.codes.row(y)[3 * x + static_cast<int>(c)] =
            static_cast<std::uint8_t>(std::lround(255 * std::pow(value, 1 / 2.2)));
      }
    }
  }
  for (int i = 0; i < calib::chart_patch_count; ++i) {
    const auto corner = calib::measured_corners(chart.found.grid, i);
    for (std::size_t k = 0; k < 4; ++k) draw(out, corner[k], corner[(k + 1) % 4], i == 0 ? first : outline);
  }
  return out;
}

}  // namespace lowlux::cli
