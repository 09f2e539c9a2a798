#include "isp/raw/corrections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>
#include <vector>

#include "isp/base/cfa.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

Plane<float> ones(int width, int height) {
  Plane<float> plane(width, height);
  std::fill_n(plane.data(), plane.size(), 1.0f);
  return plane;
}

// A 2x2 map whose points lie on the corners of the area.
GainMap corner_map(int size, std::vector<float> gain) {
  GainMap map;
  map.bottom = map.right = size;
  map.points_v = map.points_h = 2;
  map.gain = std::move(gain);
  return map;
}

TEST(GainMap, IsBilinearBetweenItsPoints) {
  Plane<float> plane = ones(10, 10);
  apply_gains({.gain_maps = {corner_map(10, {1, 2, 3, 4})}, .radial_gains = {}, .defects = {}}, plane.view(),
              one_thread);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) EXPECT_NEAR(plane.at(x, y), 1 + (x + 0.5) / 10 + 2 * (y + 0.5) / 10, 1e-6);
  }
}

TEST(GainMap, PitchAndAreaChooseOneCfaSite) {
  GainMap map = corner_map(9, {2, 2, 2, 2});
  map.top = 1;
  map.left = 2;
  map.row_pitch = map.column_pitch = 2;
  for (const int threads : {1, 3}) {
    Plane<float> plane = ones(12, 12);
    PoolExecutor pool(threads);
    apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), pool);
    for (int y = 0; y < 12; ++y) {
      for (int x = 0; x < 12; ++x) {
        const bool inside = y >= 1 && y < 9 && x >= 2 && x < 9;
        EXPECT_EQ(plane.at(x, y), inside && y % 2 == 1 && x % 2 == 0 ? 2.0f : 1.0f);
      }
    }
  }
}

TEST(GainMap, WithAPointInTheMiddleOfEachPixelItMultipliesEachByItsOwn) {
  constexpr int width = 37, height = 23;
  GainMap map;
  map.bottom = map.points_v = height;
  map.right = map.points_h = width;
  map.spacing_v = 1.0 / height;
  map.spacing_h = 1.0 / width;
  map.origin_v = 0.5 / height;
  map.origin_h = 0.5 / width;
  for (int i = 0; i < width * height; ++i) map.gain.push_back(static_cast<float>(1 + (i * 37 % 101) / 100.0));
  const RawCorrections corrections{.gain_maps = {map}, .radial_gains = {}, .defects = {}};
  Plane<float> whole = ones(width, height), tile = ones(10, 8);
  apply_gains(corrections, whole.view(), one_thread);
  apply_gains(corrections, {20, 12, width, height}, tile.view(), one_thread);
  for (int y = 0; y < height; ++y) {
    // Positions are rounded to 1e-14 of a pixel, gains to floats.
    for (int x = 0; x < width; ++x) EXPECT_NEAR(whole.at(x, y), map.gain[y * width + x], 1e-6);
  }
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 10; ++x) EXPECT_EQ(tile.at(x, y), whole.at(x + 20, y + 12));
  }
}

// A flat f of known variance: V / f^2 + s^2 V_f / f^4, over three decades of response and of noise.
TEST(GainMap, NoiseOfMeasuredGainsIsAddedToTheVariance) {
  constexpr unsigned seed = 20261127;
  std::mt19937_64 engine(seed);
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>()(engine));
  };
  for (int draw = 0; draw < 100; ++draw) {
    const int width = 3 + draw % 8, height = 2 + draw % 5;
    GainMap flat{.bottom = height, .right = width, .points_v = height, .points_h = width};
    flat.spacing_v = 1.0 / height;
    flat.spacing_h = 1.0 / width;
    flat.origin_v = 0.5 / height;
    flat.origin_h = 0.5 / width;
    for (GainNoise& noise : flat.noise) noise = {.shot = log_uniform(1e-6, 1e-3), .read = log_uniform(1e-8, 1e-4)};
    Plane<float> pixels(width, height), cells((width + 1) / 2, (height + 1) / 2);
    std::vector<double> response, signal(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      response.push_back(log_uniform(1e-3, 1));
      flat.gain.push_back(static_cast<float>(1 / response.back()));
      pixels.data()[i] = static_cast<float>(signal[i] = log_uniform(1, 1e4));
    }
    std::fill_n(cells.data(), cells.size(), 100.0F);
    const RawCorrections corrections{.gain_maps = {flat}, .radial_gains = {}, .defects = {}};
    apply_gains(corrections, pixels.view(), one_thread);
    apply_gains_to_variance(corrections, std::as_const(pixels).view(), cells.view(), one_thread);
    for (int y = 0; y < cells.height(); ++y) {
      for (int x = 0; x < cells.width(); ++x) {
        double sum = 0, n = 0;
        for (int v = 2 * y; v < std::min(2 * y + 2, height); ++v) {
          for (int u = 2 * x; u < std::min(2 * x + 2, width); ++u) {
            const auto i = static_cast<std::size_t>(v) * width + u;
            const GainNoise& noise = flat.noise[static_cast<std::size_t>(site_of(u, v))];
            const double f = response[i], variance_f = f * f * (noise.shot / f + noise.read / (f * f));
            sum += 100 / (f * f) + signal[i] * signal[i] * variance_f / std::pow(f, 4);
            ++n;
          }
        }
        EXPECT_NEAR(cells.at(x, y), sum / n, 1e-5 * sum / n)  // floats, and places between points of the map
            << "seed " << seed << ", draw " << draw << ": " << x << " " << y;
      }
    }
  }
}

TEST(GainMap, VarianceIsMultipliedByTheMeanSquareOfTheGainsOfItsCell) {
  constexpr int width = 9, height = 7;
  GainMap site;  // of every second pixel
  site.bottom = height;
  site.right = width;
  site.column_pitch = 2;
  site.gain = {3};
  const RadialGain radial{.k = {0.5}};
  const RawCorrections corrections{.gain_maps = {site}, .radial_gains = {radial}, .defects = {}};
  Plane<float> gains = ones(width, height), cells = ones((width + 1) / 2, (height + 1) / 2);
  apply_gains(corrections, gains.view(), one_thread);
  apply_gains_to_variance(corrections, std::as_const(gains).view(), cells.view(), one_thread);
  for (int y = 0; y < cells.height(); ++y) {
    for (int x = 0; x < cells.width(); ++x) {
      double squares = 0, n = 0;
      for (int v = 2 * y; v < std::min(2 * y + 2, height); ++v) {
        for (int u = 2 * x; u < std::min(2 * x + 2, width); ++u) squares += std::pow(gains.at(u, v), 2), ++n;
      }
      EXPECT_NEAR(cells.at(x, y), squares / n, 1e-5) << x << " " << y;  // 1e-6 relative: floats
    }
  }
  Plane<float> plain = ones(4, 4);
  apply_gains_to_variance({}, std::as_const(gains).view(), plain.view(), one_thread);
  EXPECT_EQ(plain.at(3, 3), 1);
}

TEST(GainMap, OutsideItsPointsItKeepsTheNearest) {
  GainMap map = corner_map(8, {1, 5, 1, 5});
  map.origin_h = 0.5;
  map.spacing_h = 0.25;
  Plane<float> plane = ones(8, 8);
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), one_thread);
  EXPECT_FLOAT_EQ(plane.at(0, 3), 1);
  EXPECT_FLOAT_EQ(plane.at(7, 3), 5);
}

TEST(GainMap, ASinglePointIsOneGainAndNegativeValuesStayNegative) {
  GainMap map;
  map.bottom = map.right = 4;
  map.gain = {1.5f};
  Plane<float> plane = ones(4, 4);
  plane.at(1, 1) = -2;
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, plane.view(), one_thread);
  EXPECT_FLOAT_EQ(plane.at(1, 1), -3);
  EXPECT_FLOAT_EQ(plane.at(3, 0), 1.5);
}

TEST(GainMap, PlanesOfRgbAreChosenByTheMap) {
  GainMap map = corner_map(4, {2, 2, 2, 2});
  map.first_plane = 1;
  map.planes = 2;
  Plane<float> r = ones(4, 4), g = ones(4, 4), b = ones(4, 4);
  apply_gains({.gain_maps = {map}, .radial_gains = {}, .defects = {}}, {r.view(), g.view(), b.view()}, one_thread);
  EXPECT_EQ(r.at(2, 2), 1);
  EXPECT_EQ(g.at(2, 2), 2);
  EXPECT_EQ(b.at(2, 2), 2);
}

TEST(RadialGain, IsOneAtTheCentreAndTheSumOfItsTermsInTheFarthestCorner) {
  RadialGain gain{.k = {0.1, 0.2, 0.3, 0.4, 0.5}, .centre_x = 0.25, .centre_y = 0.25};
  Plane<float> plane = ones(9, 9);
  apply_gains({.gain_maps = {}, .radial_gains = {gain}, .defects = {}}, plane.view(), one_thread);
  EXPECT_FLOAT_EQ(plane.at(2, 2), 1);
  EXPECT_FLOAT_EQ(plane.at(8, 8), 2.5);
  const double r2 = 0.5;  // (8, 2) is at distance 6 of 6 sqrt(2)
  EXPECT_NEAR(plane.at(8, 2),
              1 + 0.1 * r2 + 0.2 * r2 * r2 + 0.3 * std::pow(r2, 3) + 0.4 * std::pow(r2, 4) + 0.5 * std::pow(r2, 5),
              1e-6);
}

TEST(GainMap, AllOnesHasNoEffect) {
  EXPECT_FALSE(has_effect(corner_map(4, {1, 1, 1, 1})));
  EXPECT_TRUE(has_effect(corner_map(4, {1, 1, 1, 1.01f})));
}

}  // namespace
}  // namespace lowlux::isp
