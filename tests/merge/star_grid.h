#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "isp/base/executor.h"
#include "isp/merge/stars/find_stars.h"
#include "tests/merge/star_scene.h"

/// Grids of stars, and what is found of them.
namespace lowlux::star_testing {

using merge::Star;
using merge::StarField;
using merge::StarOptions;

inline constexpr float nan = std::numeric_limits<float>::quiet_NaN();
inline constexpr int spacing = 40;  // of stars on a grid

inline double normal_tail(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// Stars of one flux near the nodes of a grid, so that none is near another.
inline std::vector<TrueStar> star_grid(const StarCamera& camera, double green_flux_e, Draw& draw) {
  std::vector<TrueStar> stars;
  for (int j = 0; j < camera.height / spacing; ++j) {
    for (int i = 0; i < camera.width / spacing; ++i) {
      TrueStar star{spacing * (i + 0.5) + draw.uniform(), spacing * (j + 0.5) + draw.uniform()};
      for (std::size_t c = 0; c < 3; ++c) star.flux_e[c] = green_flux_e * camera.sky_e[c] / camera.sky_e[1];
      stars.push_back(star);
    }
  }
  return stars;
}

/// Pairs what was found with the true star of its square of the grid, if it is within 2.5 px.
template <class Visit>
int for_each_found(const StarCamera& camera, const StarField& field, const std::vector<TrueStar>& stars,
                   const Visit& visit) {
  int found = 0;
  for (const Star& star : field.stars) {
    const int i = static_cast<int>(star.x_px.value / spacing), j = static_cast<int>(star.y_px.value / spacing);
    const std::size_t index = static_cast<std::size_t>(j) * static_cast<std::size_t>(camera.width / spacing) + i;
    if (i >= camera.width / spacing || index >= stars.size()) continue;
    const TrueStar& truth = stars[index];
    if (std::hypot(star.x_px.value - truth.x, star.y_px.value - truth.y) > 2.5) continue;
    visit(star, truth);
    ++found;
  }
  return found;
}

/// Mean and mean square of errors in units of their standard errors.
struct Errors {
  double count = 0, sum = 0, squares = 0;
  void add(const Estimate& estimate, double truth) {
    const double error = (estimate.value - truth) / estimate.standard_error;
    count += 1;
    sum += error;
    squares += error * error;
  }
  double mean() const { return sum / count; }
  double rms() const { return std::sqrt(squares / count); }
};

inline StarField found_in(const StarCamera& camera, const Plane<float>& frame, StarOptions options = {},
                          int threads = 1) {
  PoolExecutor executor(threads);
  return find_stars(view_of(camera, frame), options, executor);
}

}  // namespace lowlux::star_testing
