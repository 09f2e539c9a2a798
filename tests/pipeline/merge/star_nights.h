#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "tests/merge/star_scene.h"
#include "tests/pipeline/merge/merge_bursts.h"

/// Bursts of a night sky that turns, and measures of its stars.
namespace lowlux::test {

struct SkyStar {
  double x, y, peak_e;
};

/// A sky of stars that lie apart, each a Gaussian of `sigma_px` as the pixels sample it.
struct Sky {
  double sky_e = 30;
  double sigma_px = 1.1;
  std::vector<SkyStar> stars;

  /// Draws stars on a grid, away from its lines, so that each can be measured by itself; beyond the frame too.
  Sky(std::uint64_t seed, double faintest_e, double brightest_e) {
    star_testing::Draw draw(seed);
    for (int row = -3; row < 11; ++row) {
      for (int column = -3; column < 14; ++column) {
        const double x = 24 * column + draw.uniform(6, 18), y = 24 * row + draw.uniform(6, 18);
        stars.push_back({x, y, faintest_e * std::pow(brightest_e / faintest_e, draw.uniform())});
      }
    }
  }

  double at(double x, double y) const {
    const int column = static_cast<int>(std::floor(x / 24)) + 3, row = static_cast<int>(std::floor(y / 24)) + 3;
    if (column < 0 || column >= 17 || row < 0 || row >= 14) return sky_e;
    const SkyStar& star = stars[static_cast<std::size_t>(row) * 17 + column];
    return sky_e +
           star.peak_e * std::exp(-(std::pow(x - star.x, 2) + std::pow(y - star.y, 2)) / (2 * sigma_px * sigma_px));
  }
};

/// The sky drifts and turns from frame to frame.
inline Burst night(const Sky& sky, double turn_deg = 0.15) {
  Burst burst{.width = 256, .height = 192, .read_noise_e = 3};
  burst.scene = [&sky](double x, double y, int) { return sky.at(x, y); };
  burst.position = [turn_deg](int index, double x, double y) {
    const double turn = turn_deg * index * std::numbers::pi / 180;
    const double u = x - 127.5 - 1.7 * index, v = y - 95.5 + 0.9 * index;
    return std::array{127.5 + u * std::cos(turn) + v * std::sin(turn), 95.5 - u * std::sin(turn) + v * std::cos(turn)};
  };
  return burst;
}

/// Flux, and variance along an axis, of what a picture has above the sky around a star.
struct Moments {
  double flux_e = 0;
  double variance_px2 = 0;
};

/// @param value  of a picture at a pixel, of `per_px` pixels to one of the reference
template <class Value>
Moments moments_of(const SkyStar& star, double sky_e, double per_px, const Value& value) {
  const double cx = (star.x + 0.5) * per_px - 0.5, cy = (star.y + 0.5) * per_px - 0.5, radius = 5.5 * per_px;
  double flux = 0, square = 0;
  for (int y = static_cast<int>(std::ceil(cy - radius)); y <= cy + radius; ++y) {
    for (int x = static_cast<int>(std::ceil(cx - radius)); x <= cx + radius; ++x) {
      const double r2 = std::pow(x - cx, 2) + std::pow(y - cy, 2);
      if (r2 > radius * radius) continue;
      flux += value(x, y) - sky_e;
      square += r2 * (value(x, y) - sky_e);
    }
  }
  return {flux / (per_px * per_px), square / flux / 2 / (per_px * per_px)};
}

/// Returns the sum of flux and the mean width over the stars that lie well within the frame.
template <class Value>
Moments moments_of_stars(const Sky& sky, const Burst& burst, double per_px, const Value& value) {
  Moments sum;
  for (const SkyStar& star : sky.stars) {
    if (star.x < 50 || star.y < 50 || star.x > burst.width - 50 || star.y > burst.height - 50) continue;
    const Moments one = moments_of(star, sky.sky_e, per_px, value);
    sum.flux_e += one.flux_e;
    sum.variance_px2 += one.variance_px2 * one.flux_e;
  }
  return {sum.flux_e, sum.variance_px2 / sum.flux_e};
}

}  // namespace lowlux::test
