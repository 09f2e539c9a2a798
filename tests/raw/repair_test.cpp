#include "isp/raw/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "isp/raw/black_point.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

constexpr int side = 96;
constexpr double read_noise_dn = 10;

// A night sky: black 256, noise, and nothing else.
RawDn dark_sky(unsigned seed) {
  test::NormalDn normal(seed);
  RawDn raw =
      test::bayer_frame(side, side, BayerPhase::rggb, [&](int, int) { return normal(256 + 40, read_noise_dn); });
  raw.black_tag->pattern_dn = {256};
  return raw;
}

void add(RawDn& raw, int x, int y, double dn) {
  raw.dn.at(x, y) = static_cast<std::uint16_t>(std::clamp(raw.dn.at(x, y) + dn, 0.0, 4095.0));
}

// Light of a star with a Gaussian spot of the given full width at half maximum [pixels], its centre off the grid.
void add_star(RawDn& raw, double cx, double cy, double fwhm, double peak_dn) {
  const double two_sigma2 = 2 * std::pow(fwhm / 2.3548, 2);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      add(raw, x, y, std::round(peak_dn * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / two_sigma2)));
    }
  }
}

std::vector<Pixel> defects_of(const RawDn& raw, int threads = 1) {
  PoolExecutor pool(threads);
  return find_defects(raw, *choose_black(raw, {BlackChoice::metadata}), {read_noise_dn}, pool);
}

TEST(FindDefects, FindsHotAndDeadPixelsAndNothingElse) {
  RawDn raw = dark_sky(1);
  add(raw, 10, 20, 900);
  add(raw, 51, 33, 3000);
  add(raw, 70, 71, 500);
  EXPECT_EQ(defects_of(raw), (std::vector<Pixel>{{10, 20}, {51, 33}, {70, 71}}));

  RawDn lit = test::bayer_frame(side, side, BayerPhase::rggb, [](int x, int y) { return 1500 + (x + y) % 7; });
  lit.dn.at(40, 41) = 0;
  EXPECT_EQ(defects_of(lit), (std::vector<Pixel>{{40, 41}}));
}

TEST(FindDefects, NoiseAloneIsNeverADefect) {
  for (unsigned seed = 10; seed < 40; ++seed) EXPECT_TRUE(defects_of(dark_sky(seed)).empty());
}

TEST(FindDefects, KeepsStarsWhereverTheyFallOnTheGrid) {
  for (const double fwhm : {1.5, 2.0, 3.0}) {
    for (const double peak : {300.0, 1000.0, 3500.0}) {
      for (int step = 0; step < 16; ++step) {
        RawDn raw = dark_sky(100 + step);
        const int column = step % 4, row = step / 4;
        add_star(raw, 40 + 0.25 * column, 41 + 0.25 * row, fwhm, peak);
        EXPECT_TRUE(defects_of(raw).empty()) << "fwhm " << fwhm << " peak " << peak << " step " << step;
      }
    }
  }
}

/// Draws a position within two pixels of a border.
Pixel at_border(std::mt19937& random) {
  std::uniform_int_distribution<int> along(0, side - 1), across(0, 3);
  const int near = std::array{0, 1, side - 2, side - 1}[static_cast<std::size_t>(across(random))];
  return std::uniform_int_distribution<int>(0, 1)(random) == 0 ? Pixel{near, along(random)}
                                                               : Pixel{along(random), near};
}

TEST(FindDefects, FindsThoseAtTheBorders) {
  std::mt19937 random(20261128);
  for (unsigned seed = 1; seed <= 200; ++seed) {
    RawDn raw = dark_sky(seed);
    const Pixel hot = at_border(random);
    add(raw, hot.x, hot.y, std::uniform_real_distribution<double>(800, 3500)(random));
    EXPECT_EQ(defects_of(raw), std::vector<Pixel>{hot}) << "seed " << seed << " at " << hot.x << ", " << hot.y;
  }
}

TEST(FindDefects, KeepsStarsAtTheBorders) {
  std::mt19937 random(20261129);
  std::uniform_real_distribution<double> offset(-0.5, 0.5), widening(0, 1), peak(300, 3500);
  for (unsigned seed = 1; seed <= 3000; ++seed) {
    RawDn raw = dark_sky(seed);
    const Pixel at = at_border(random);
    const double x = at.x + offset(random), y = at.y + offset(random),
                 width = 1.5 + std::pow(widening(random), 3);  // most near 1.5
    add_star(raw, x, y, width, peak(random));
    EXPECT_TRUE(defects_of(raw).empty()) << "seed " << seed << " at " << x << ", " << y << " fwhm " << width;
  }
}

TEST(FindDefects, KeepsEdgesAndFineLines) {
  const RawDn edge = test::bayer_frame(side, side, BayerPhase::gbrg, [](int x, int) { return x < 48 ? 300 : 3800; });
  EXPECT_TRUE(defects_of(edge).empty());
  const RawDn line = test::bayer_frame(side, side, BayerPhase::gbrg, [](int x, int) { return x == 47 ? 3800 : 300; });
  EXPECT_TRUE(defects_of(line).empty());
  const RawDn border = test::bayer_frame(side, side, BayerPhase::gbrg, [](int x, int) { return x == 0 ? 3800 : 300; });
  EXPECT_TRUE(defects_of(border).empty());
}

TEST(FindDefects, AnyThreadCountFindsTheSame) {
  RawDn raw = dark_sky(2);
  for (int i = 0; i < 30; ++i) add(raw, 3 + (i * 37) % 90, 3 + (i * 53) % 90, 1000);
  const std::vector<Pixel> one = defects_of(raw);
  EXPECT_GT(one.size(), 20u);
  for (const int threads : {2, 3, 7}) EXPECT_EQ(defects_of(raw, threads), one);
}

TEST(FindDefects, TinyFramesHaveNone) {
  EXPECT_TRUE(defects_of(test::bayer_frame(4, 4, BayerPhase::rggb, [](int x, int y) {
                return x == 2 && y == 2 ? 4000 : 0;
              })).empty());
}

TEST(NamedDefects, AreClippedToTheFrameSortedAndEachOnce) {
  const RawDn raw = test::bayer_frame(8, 8, BayerPhase::rggb, [](int, int) { return 0; });
  EXPECT_EQ(named_defects(raw, {{6, 6, 4, 1}, {1, 2, 1, 1}, {6, 6, 1, 1}, {-3, -3, 2, 2}, {100, 0, 1, 1}}),
            (std::vector<Pixel>{{1, 2}, {6, 6}, {7, 6}}));
  EXPECT_FALSE(named_defects(raw, {{0, 0, 8, 8}}));  // a source that names everything is at fault
}

Plane<float> ramp(int width, int height) {
  Plane<float> plane(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.at(x, y) = static_cast<float>(x - 20);
  }
  return plane;
}

TEST(Repair, FollowsTheDirectionOfLeastDifference) {
  Plane<float> plane = ramp(40, 9);
  plane.at(5, 4) = 1000;
  repair(plane.view(), {{5, 4}}, 2);
  EXPECT_EQ(plane.at(5, 4), -15);  // above and below are equal; values below zero are kept
}

TEST(Repair, DefectiveNeighboursDoNotCount) {
  Plane<float> plane = ramp(40, 9);
  for (const Pixel p : {Pixel{5, 2}, Pixel{5, 4}, Pixel{7, 4}}) plane.at(p.x, p.y) = 1000;
  repair(plane.view(), {{5, 2}, {5, 4}, {7, 4}}, 2);
  EXPECT_EQ(plane.at(7, 4), -13);
  // Left (3, 4) and below (5, 6) of (5, 4) are sound, neither pair is whole: their mean.
  EXPECT_EQ(plane.at(5, 4), (-17.0f - 15.0f) / 2);
}

TEST(Repair, BordersUseWhatLiesInsideAndALonePixelStays) {
  Plane<float> plane = ramp(40, 9);
  plane.at(0, 0) = 1000;
  repair(plane.view(), {{0, 0}}, 2);
  EXPECT_EQ(plane.at(0, 0), (-18.0f - 20.0f) / 2);
  Plane<float> lone(1, 1);
  lone.at(0, 0) = 5;
  repair(lone.view(), {{0, 0}}, 2);
  EXPECT_EQ(lone.at(0, 0), 5);
}

}  // namespace
}  // namespace lowlux::isp
