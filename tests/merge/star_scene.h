#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/random/random.h"
#include "isp/merge/frame.h"

/// Simulated fields of stars, with truth.
namespace lowlux::star_testing {

/// Draws uniform numbers in 0..1, one for each call.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : seed_(seed) {}
  double uniform() {
    return (words_at({.seed = seed_, .purpose = draw_purpose::scene}, index_++, 0)[0] + 0.5) * 0x1p-32;
  }
  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }
  double normal() { return static_cast<double>(normal_of_word(words_at({.seed = seed_}, index_++, 1)[0])); }

 private:
  std::uint64_t seed_;
  std::uint32_t index_ = 0;
};

struct TrueStar {
  double x = 0;
  double y = 0;
  std::array<double, 3> flux_e{};
};

struct StarCamera {
  int width = 640;
  int height = 480;
  BayerPhase phase = BayerPhase::rggb;
  double sigma_px = 1.2;
  std::array<double, 3> sky_e{30, 60, 40};
  double read_noise_e = 3;

  PerSite<double> variance_e2() const {
    const double v = read_noise_e * read_noise_e;
    return {v, v, v, v};
  }
  /// Returns the snr of the best filter for a star of the colour of the sky, whose flux in green is given.
  double snr_of(double green_flux_e) const {
    double sum = 0;
    for (int site = 0; site < 4; ++site) {
      const auto c = static_cast<std::size_t>(colour_at(phase, site % 2, site / 2));
      sum += std::pow(green_flux_e * sky_e[c] / sky_e[1], 2) / (sky_e[c] + read_noise_e * read_noise_e) / 4;
    }
    const double axis = sigma_px * sigma_px + 1.0 / 12;  // integration over pixels, to second order
    return std::sqrt(sum / (4 * std::numbers::pi * axis));
  }
};

inline double pixel_integral(double centre, double sigma) {
  const double scale = std::numbers::sqrt2 * sigma;
  return (std::erf((centre + 0.5) / scale) - std::erf((centre - 0.5) / scale)) / 2;
}

/// Adds stars to a plane of expected values.
inline void add_stars(const StarCamera& camera, const std::vector<TrueStar>& stars, Plane<float>& mean) {
  const int radius = static_cast<int>(std::ceil(6 * camera.sigma_px));
  for (const TrueStar& star : stars) {
    if (!(std::fabs(star.x) < 1e6 && std::fabs(star.y) < 1e6)) continue;
    const int cx = static_cast<int>(std::lround(star.x)), cy = static_cast<int>(std::lround(star.y));
    for (int y = std::max(cy - radius, 0); y <= std::min(cy + radius, camera.height - 1); ++y) {
      const double row = pixel_integral(y - star.y, camera.sigma_px);
      for (int x = std::max(cx - radius, 0); x <= std::min(cx + radius, camera.width - 1); ++x) {
        const auto c = static_cast<std::size_t>(colour_at(camera.phase, x, y));
        mean.at(x, y) += static_cast<float>(star.flux_e[c] * row * pixel_integral(x - star.x, camera.sigma_px));
      }
    }
  }
}

/// Returns the expected values of a frame: the sky alone.
inline Plane<float> sky_of(const StarCamera& camera) {
  Plane<float> mean(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      mean.at(x, y) = static_cast<float>(camera.sky_e[static_cast<std::size_t>(colour_at(camera.phase, x, y))]);
    }
  }
  return mean;
}

/// Replaces expected values by a draw: Poisson and read noise.
inline void expose(const StarCamera& camera, std::uint64_t seed, Plane<float>& mean) {
  const DrawStream stream{.seed = seed, .purpose = draw_purpose::electrons};
  const auto width = static_cast<std::size_t>(camera.width);
  std::vector<float> normal(width);
  for (int y = 0; y < camera.height; ++y) {
    const auto row = static_cast<std::uint32_t>(y);
    poisson_row(stream, 0, row, {mean.row(y), width}, {mean.row(y), width});
    normal_row(stream, 0, row, 1, normal);
    for (int x = 0; x < camera.width; ++x)
      mean.at(x, y) += static_cast<float>(camera.read_noise_e) * normal[static_cast<std::size_t>(x)];
  }
}

inline Plane<float> exposed(const StarCamera& camera, const std::vector<TrueStar>& stars, std::uint64_t seed) {
  Plane<float> frame = sky_of(camera);
  add_stars(camera, stars, frame);
  expose(camera, seed, frame);
  return frame;
}

inline merge::FrameView view_of(const StarCamera& camera, const Plane<float>& frame) {
  return {frame.view(), camera.phase, camera.variance_e2()};
}

/// Draws stars of the colour of the sky over a rectangle, their numbers falling as 1 / flux: fluxes from min_flux_e
/// (green) on.
inline std::vector<TrueStar> drawn_stars(const StarCamera& camera, int count, double min_flux_e, Draw& draw,
                                         double margin_px = 0) {
  std::vector<TrueStar> stars;
  for (int i = 0; i < count; ++i) {
    const double flux = min_flux_e / std::max(draw.uniform(), 1e-3);
    TrueStar star{draw.uniform(-margin_px, camera.width - 1 + margin_px),
                  draw.uniform(-margin_px, camera.height - 1 + margin_px)};
    for (std::size_t c = 0; c < 3; ++c) star.flux_e[c] = flux * camera.sky_e[c] / camera.sky_e[1];
    stars.push_back(star);
  }
  return stars;
}

}  // namespace lowlux::star_testing
