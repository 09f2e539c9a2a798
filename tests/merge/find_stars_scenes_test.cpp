#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/merge/star_grid.h"

/// What is and what is not a star, with everything that night frames have.
namespace lowlux::merge {
namespace {

using namespace star_testing;

TEST(FindStars, HotPixelsAreNotStars) {
  const StarCamera camera{.width = 1600, .height = 1600};
  Plane<float> frame = exposed(camera, {}, 3);
  Draw draw(4);
  int hot = 0;
  for (int y = 10; y < camera.height - 10; y += 20) {
    for (int x = 10; x < camera.width - 10; x += 20, ++hot) {
      frame.at(x + static_cast<int>(4 * draw.uniform()), y + static_cast<int>(4 * draw.uniform())) +=
          static_cast<float>(100 * std::pow(300, draw.uniform()));
    }
  }
  const StarField field = found_in(camera, frame, {.max_stars = 20000});
  const double allowed = 2.6 + normal_tail(3) * hot;  // what is left is noise, and has to exceed 3 standard deviations
  EXPECT_LE(static_cast<double>(field.stars.size()), allowed + 5 * std::sqrt(allowed));
  EXPECT_GE(field.not_stars.single_sites, hot * 95 / 100);
}

TEST(FindStars, GalaxiesLampsAndEdgesAreNotStars) {
  const StarCamera camera{.width = 1200, .height = 1200};
  Draw draw(2);
  const std::vector<TrueStar> stars = drawn_stars(camera, 100, 2000, draw);
  Plane<float> frame = sky_of(camera);
  add_stars(camera, stars, frame);
  for (int k = 0; k < 25; ++k) {
    const int column = k % 5, row = k / 5;
    const double cx = 120 + 240 * column, cy = 120 + 240 * row, size = 5 + k % 4;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double r = std::hypot(x - cx, 1.5 * (y - cy));
        if (r > 100) continue;
        if (k % 3 == 0) frame.at(x, y) += static_cast<float>(3000 * std::exp(-r / size));             // galaxy
        if (k % 3 == 1) frame.at(x, y) += static_cast<float>(r < 14 ? 60000 : 4e6 / std::pow(r, 3));  // lamp
        if (k % 3 == 2 && x > cx && x < cx + 60 && y > cy && y < cy + 40) frame.at(x, y) += 900;      // window
      }
    }
  }
  expose(camera, 5, frame);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x)
      if (frame.at(x, y) > 50000) frame.at(x, y) = nan;
  }
  const StarField field = found_in(camera, frame);
  int false_stars = 0;
  for (const Star& star : field.stars) {
    false_stars += std::none_of(stars.begin(), stars.end(), [&](const TrueStar& truth) {
      return std::hypot(star.x_px.value - truth.x, star.y_px.value - truth.y) < 2;
    });
  }
  EXPECT_GE(field.stars.size(), 70U);  // some are behind the lamps and windows
  EXPECT_LE(false_stars, 7);           // 1.4 are stated for noise, five standard deviations more
}

TEST(FindStars, SaturatedStarsAreFoundOnceByTheirWings) {
  const StarCamera camera{.width = 800, .height = 800, .sigma_px = 1.4};
  Draw draw(6);
  const std::vector<TrueStar> stars = star_grid(camera, 4e5, draw);
  Plane<float> frame = exposed(camera, stars, 5);
  int missing = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (frame.at(x, y) < 10000) continue;
      frame.at(x, y) = nan;
      ++missing;
    }
  }
  EXPECT_GT(missing, 5 * static_cast<int>(stars.size()));
  const StarField field = found_in(camera, frame);
  Errors x;
  const int found =
      for_each_found(camera, field, stars, [&](const Star& star, const TrueStar& t) { x.add(star.x_px, t.x); });
  EXPECT_EQ(found, static_cast<int>(stars.size()));
  EXPECT_LE(field.stars.size(), stars.size() + 3);
  EXPECT_LT(x.rms(), 1.3);
}

TEST(FindStars, DefectsThatAreLeftOutNeitherHideStarsNorMakeThem) {
  const StarCamera camera{.width = 1600, .height = 1600};
  Draw draw(8);
  const std::vector<TrueStar> stars = star_grid(camera, 30 / camera.snr_of(1), draw);
  Plane<float> frame = exposed(camera, stars, 5);
  for (std::size_t k = 0; k < frame.size(); ++k)
    if (draw.uniform() < 0.01) frame.data()[k] = nan;
  const StarField field = found_in(camera, frame, {.max_stars = 4000});
  const int found = for_each_found(camera, field, stars, [](const Star&, const TrueStar&) {});
  EXPECT_GE(found, static_cast<int>(stars.size()) * 98 / 100);
  EXPECT_LE(static_cast<int>(field.stars.size()) - found, 16);  // 2.6 are stated, five standard deviations more
}

TEST(FindStars, StarsOfOtherPsfsAreStars) {
  const StarCamera camera{.width = 800, .height = 800};
  for (const bool elongated : {false, true}) {
    Plane<float> frame = sky_of(camera);
    Draw draw(9);
    const std::vector<TrueStar> stars = star_grid(camera, 1, draw);
    for (const TrueStar& star : stars) {
      const double flux = 2000 * std::pow(50, draw.uniform());
      for (int y = static_cast<int>(star.y) - 15; y <= star.y + 15; ++y) {
        for (int x = static_cast<int>(star.x) - 15; x <= star.x + 15; ++x) {
          const double dx = x - star.x, dy = y - star.y, stretched = elongated ? dx / 1.5 : dx;
          const double r2 = stretched * stretched + dy * dy;
          const double moffat = std::pow(1 + r2 / 5.2, -3.0) * 2 / (std::numbers::pi * 5.2);
          const double gauss = std::exp(-r2 / 2.4) / (std::numbers::pi * 2.4 * 1.5);
          frame.at(x, y) += static_cast<float>(flux * (elongated ? gauss : moffat));
        }
      }
    }
    expose(camera, 5, frame);
    const StarField field = found_in(camera, frame);
    EXPECT_GE(for_each_found(camera, field, stars, [](const Star&, const TrueStar&) {}),
              static_cast<int>(stars.size()) * 95 / 100)
        << elongated;
  }
}

}  // namespace
}  // namespace lowlux::merge
