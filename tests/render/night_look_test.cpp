#include "isp/render/night/night_look.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "isp/base/executor.h"
#include "isp/model/vision/night_eye.h"
#include "isp/model/vision/retina.h"
#include "isp/render/night/eye_rows.h"
#include "isp/render/night/grid.h"
#include "isp/render/night/visual_noise.h"
#include "tests/reference/night_look_ref.h"

namespace lowlux::isp {
namespace {

constexpr std::array<float, 9> as_it_is{1, 0, 0, 0, 1, 0, 0, 0, 1};

NightLook rec709_look(double cd_m2) {
  NightLook look;
  look.cd_m2_per_unit = cd_m2;
  look.luminance = {0.2126f, 0.7152f, 0.0722f};
  look.rods = {-0.0126f, 0.6204f, 0.3922f};
  look.tint = {static_cast<float>(rod_tint[0]), static_cast<float>(rod_tint[1]), static_cast<float>(rod_tint[2])};
  return look;
}

CameraRgb flat(int width, int height, const std::array<float, 3>& rgb) {
  CameraRgb out(width, height);
  for (int c = 0; c < 3; ++c) std::fill_n(out.plane[c].data(), out.plane[c].size(), rgb[c]);
  return out;
}

float part_at(const LookGrid& grid, LookGrid::Part part, int x, int y) { return grid.part[part].at(x, y); }

TEST(NightLook, OfAnEvenFieldIsWhatTheEyeMakesOfIt) {
  InlineExecutor executor;
  NightLookGrid maker(256, 192);
  for (const double light : {1e-5, 0.001, 0.01, 0.1, 0.7, 3.0, 30.0}) {
    const CameraRgb camera = flat(64, 48, {0.6f, 0.5f, 0.3f});
    const NightLook look = rec709_look(light);
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    double y = 0, s = 0;
    for (int c = 0; c < 3; ++c) {
      y += look.luminance[c] * camera.plane[c].at(0, 0);
      s += look.rods[c] * camera.plane[c].at(0, 0);
    }
    const NightEye eye = night_eye({y * light, s * light * look.scotopic_ratio_of_white});
    const double rods = (1 - eye.state.m) * scotopic_at_555_nm * look.scotopic_ratio_of_white;
    for (const auto& [column, row] : {std::pair{0, 0}, {63, 47}, {31, 20}}) {
      // Linear between 256 nodes of luminance and 32 of S/P.
      EXPECT_NEAR(part_at(grid, LookGrid::rod_fraction, column, row), rods / (eye.state.m + rods), 0.004) << light;
      EXPECT_NEAR(part_at(grid, LookGrid::chroma, column, row), eye.chroma, 0.003) << light;
      EXPECT_NEAR(part_at(grid, LookGrid::blue, column, row), eye.blue, 0.003) << light;
      const double e = y + part_at(grid, LookGrid::rod_fraction, column, row) * (s - y);
      EXPECT_NEAR(part_at(grid, LookGrid::base, column, row) + part_at(grid, LookGrid::detail, column, row) * e, e,
                  2e-6)
          << "an even field has no detail to lose";
    }
  }
}

// A lamp and its surroundings over five decades, with noise below zero, at sizes odd and even.
TEST(NightLook, EqualsTheReference) {
  InlineExecutor executor;
  for (const auto& [width, height, pixels_per_degree] :
       {std::tuple{61, 47, 5.0}, {96, 64, 60.0}, {7, 1, 30.0}, {1, 9, 2.0}, {130, 75, 400.0}}) {
    CameraRgb camera(width, height);
    std::mt19937 random(4);
    std::normal_distribution<float> noise(0, 1e-5f);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double distance = std::hypot(x - 0.3 * width, y - 0.6 * height) / width;
        const double light = std::pow(10.0, -5 * std::min(1.0, 1.5 * distance));
        for (int c = 0; c < 3; ++c) {
          camera.plane[c].at(x, y) = static_cast<float>(light * (c == 0 ? 1 : 0.5 * c)) + noise(random);
        }
      }
    }
    NightLook look = rec709_look(3);
    look.pixels_per_degree = pixels_per_degree;
    NightLookGrid maker(4 * width, 4 * height);
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    const auto expected = reference::night_look(std::as_const(camera).view(), as_it_is, 1, look);
    for (int k = 0; k < LookGrid::parts; ++k) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          // Tables of 256 luminances and 32 S/P, and states that are lines between cells where the field is smooth.
          // Detail is 0..1, and so steep where blur sets in that such a line misses it by more.
          ASSERT_NEAR(grid.part[k].at(x, y), expected[k].clamped(x, y), k == LookGrid::detail ? 0.03 : 0.005)
              << k << " at " << x << "," << y << " of " << width;
        }
      }
    }
  }
}

TEST(NightLook, LeavesOutWhatIsNotAskedFor) {
  InlineExecutor executor;
  NightLookGrid maker(128, 128);
  NightLook look = rec709_look(0.01);
  look.effects = {false, false, false, false, false, false};
  const CameraRgb camera = flat(32, 32, {0.2f, 0.5f, 0.9f});
  const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
  const std::array<float, LookGrid::parts> nothing{0, 1, 0, 1, 0};
  for (int k = 0; k < LookGrid::parts; ++k) {
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) ASSERT_EQ(grid.part[k].at(x, y), nothing[k]);
    }
  }
}

// A grating of so many cycles per degree, and its contrast after the coarse part of the look.
TEST(NightLook, BlursGratingsAsMuchAsTheAcuityAsks) {
  constexpr int side = 512;
  InlineExecutor executor;
  NightLookGrid maker(4 * side, 4 * side);
  for (const double light : {0.05, 0.002, 0.0002}) {
    NightLook look = rec709_look(light);
    look.pixels_per_degree = 200;
    const double wanted = blur_std_deg(mesopic_state({0.5 * light, 1.23 * light}).luminance_cd_m2);
    const double cycles_per_deg = 0.5 / (M_PI * wanted);  // contrast exp(-1/2) after the Gaussian
    const double per_cell = cycles_per_deg * LookGrid::cell / look.pixels_per_degree;
    CameraRgb camera(side, side);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const auto v = static_cast<float>(0.5 + 0.05 * std::cos(2 * M_PI * per_cell * (x + 0.5)));
        for (Plane<float>& plane : camera.plane) plane.at(x, y) = v;
      }
    }
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    double least = 1, most = 0;
    for (int x = side / 4; x < 3 * side / 4; ++x) {
      const double seen = part_at(grid, LookGrid::base, x, side / 2) +
                          part_at(grid, LookGrid::detail, x, side / 2) * camera.plane[0].at(x, side / 2);
      least = std::min(least, seen);
      most = std::max(most, seen);
    }
    // The pyramid's kernel is no Gaussian: its variance is right, its shape is not quite.
    EXPECT_NEAR((most - least) / 0.1, std::exp(-0.5), 0.12) << light;
  }
}

/// A ramp of a colour over two decades, the brightest of so many cd/m2; a unit is 100.
CameraRgb ramp(const std::array<double, 3>& colour, double brightest_cd_m2, int width) {
  CameraRgb camera(width, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < width; ++x) {
      const double light = brightest_cd_m2 / 100 * std::pow(10.0, 2.0 * x / (width - 1) - 2);
      for (int c = 0; c < 3; ++c) camera.plane[c].at(x, y) = static_cast<float>(colour[c] * light);
    }
  }
  return camera;
}

// For a mild colour, and for reds and blues as far as the gamut goes: what is seen of their light never turns negative.
// The eye adapts to the mean of a frame as well, so that one ramp does not lead from rods to cones: seven together do.
// The rods' share is steepest where m leaves 0, b / v0 = 0.83 in a decade (mesopic.h), 0.0028 in a cell of 599; half
// more.
TEST(NightLook, HasNoSeamsAlongRampsThroughAllOfVision) {
  constexpr int width = 600;
  InlineExecutor executor;
  NightLookGrid maker(4 * width, 16);
  for (const std::array<double, 3>& colour :
       {std::array{0.9, 0.4, 0.2}, {1.0, 0.0, 0.0}, {1.0, 0.02, 0.0}, {0.0, 0.0, 1.0}, {1.0, 1.0, 0.0}}) {
    float least = 1, most = 0;
    for (const double brightest_cd_m2 : {0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 10000.0}) {
      NightLook look = rec709_look(100);
      look.pixels_per_degree = 4;  // no pooling to speak of
      const CameraRgb camera = ramp(colour, brightest_cd_m2, width);
      const LookGrid grid = maker.make(camera.view(), as_it_is, 1e9f, look, std::nullopt, executor);
      for (const LookGrid::Part part : {LookGrid::rod_fraction, LookGrid::chroma, LookGrid::blue}) {
        for (int x = 1; x < width; ++x) {
          ASSERT_LT(std::fabs(part_at(grid, part, x, 2) - part_at(grid, part, x - 1, 2)), 0.0042f) << part << " " << x;
        }
      }
      for (int x = 0; x < width; ++x) {
        ASSERT_GE(part_at(grid, LookGrid::base, x, 2), 0) << x;
        least = std::min(least, part_at(grid, LookGrid::rod_fraction, x, 2));
        most = std::max(most, part_at(grid, LookGrid::rod_fraction, x, 2));
      }
    }
    EXPECT_LT(least, 0.001f) << "cones alone";
    EXPECT_GT(most, 0.999f) << "rods alone";
  }
}

TEST(NightLook, GlareSpreadsTheLightOfALampAndAddsNothingFarAway) {
  constexpr int side = 256;
  InlineExecutor executor;
  NightLookGrid maker(4 * side, 4 * side);
  CameraRgb camera = flat(side, side, {0, 0, 0});
  for (Plane<float>& plane : camera.plane) plane.at(side / 2, side / 2) = 1000;
  NightLook look = rec709_look(1);
  look.effects = {false, false, false, false, true, false};
  look.pixels_per_degree = 40;  // ten cells
  const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1e9f, look, std::nullopt, executor);
  const auto veil = [&](int cells) { return part_at(grid, LookGrid::base, side / 2 + cells, side / 2); };
  // 10 / angle^2 times the illuminance: 1000 in a cell of 0.01 deg^2.
  const double deg2_sr = (M_PI / 180) * (M_PI / 180);
  for (const double angle : {1.5, 3.0, 6.0}) {
    const double expected = 10 * 1000 * 0.01 * deg2_sr / (angle * angle);
    const double found = veil(static_cast<int>(std::lround(angle * 10)));
    EXPECT_GT(found, 0.5 * expected) << angle;
    EXPECT_LT(found, 2.0 * expected) << angle;
  }
}

/// Mean and variance of a plane, of a Poisson variable's deviations.
struct Moments {
  double mean = 0;
  double variance = 0;
};
Moments moments_of(const PlaneView<const float>& plane) {
  Moments out;
  const double n = static_cast<double>(plane.width) * plane.height;
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) out.mean += plane.at(x, y) / n;
  }
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) out.variance += std::pow(plane.at(x, y) - out.mean, 2) / n;
  }
  return out;
}

NightLook noise_alone(double cd_m2) {
  NightLook look = rec709_look(cd_m2);
  look.effects = {false, false, false, false, false, true};
  look.scene_cd_m2 = cd_m2;
  look.pixels_per_degree = 20;
  return look;
}

// A flat over all of vision, from fields in which rods count less than one isomerisation to more than the sampler's
// limit. The noise is (1 - r) that of cones + r that of rods: its variance from the means of both counts, and standard
// errors from the fourth moment of a Poisson variable, mu + 3 mu^2.
TEST(NightLook, VisualNoiseHasMeanZeroAndTheVarianceOfPhotonsAndDarkLight) {
  constexpr int side = 192;
  constexpr double n = side * side;
  InlineExecutor executor;
  NightLookGrid maker(4 * side, 4 * side);
  for (const double light : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.7, 3.0, 100.0, 1e4, 1e6, 1e9}) {
    for (const double pixels_per_degree : {400.0, 20.0, 1.0}) {
      NightLook look = noise_alone(light);
      look.pixels_per_degree = pixels_per_degree;
      NightLook with_rods = look;
      with_rods.effects = {true, false, false, false, false, false};
      const CameraRgb camera = flat(side, side, {0.5f, 0.5f, 0.5f});
      const double r = part_at(maker.make(camera.view(), as_it_is, 1, with_rods, std::nullopt, executor),
                               LookGrid::rod_fraction, 0, 0);
      const LookGrid grid = maker.make(camera.view(), as_it_is, 1, look, std::nullopt, executor);
      const double area = std::pow(4 / pixels_per_degree, 2), pupil = pupil_area_mm2(adapted_pupil_mm(light));
      double variance = 0, fourth = 0;
      for (const auto& [cell, weight, unit] :
           {std::tuple{cones_in(area, pupil), 1 - r, light}, {rods_in(area, pupil), r, 2.46 * light}}) {
        const double mean = cell.counts_per_cd_m2 * 0.5 * unit + cell.dark_counts;
        const double per_count = weight / (cell.counts_per_cd_m2 * unit);
        variance += per_count * per_count * mean;
        fourth += std::pow(per_count, 4) * mean;  // the fourth cumulant of a Poisson variable is its mean
      }
      const Moments found = moments_of(grid.part[LookGrid::base]);
      EXPECT_NEAR(found.mean, 0, 5 * std::sqrt(variance / n)) << light << " " << pixels_per_degree;
      // The rods' fraction is that of the table, and means are floats.
      EXPECT_NEAR(found.variance, variance, 5 * std::sqrt((fourth + 2 * variance * variance) / n) + 1e-4 * variance)
          << light << " " << pixels_per_degree;
      for (int x = 0; x < side; ++x) {
        ASSERT_EQ(part_at(grid, LookGrid::detail, x, 0), 1) << "nothing is softened";
        ASSERT_EQ(part_at(grid, LookGrid::rod_fraction, x, 0), 0) << "nor shifted";
      }
    }
  }
}

// Means on both sides of the sampler's branch at 12 and of its limit at 1e6.
TEST(VisualNoise, DrawsMeanAndVarianceOnBothSidesOfEachBranch) {
  constexpr int n = 200000;
  VisualNoise noise = visual_noise(noise_alone(1));
  noise.rods = {1, 0.25f, 1};
  noise.cones = {2, 0.5f, 0.125f};
  for (const double light : {0.0, 0.1, 1.0, 11.5, 12.5, 1e4, 9e5, 1.1e6, 1e9}) {
    const std::vector<float> luminance(n, static_cast<float>(light));
    std::vector<float> cones(n), rods(n), scratch(n);
    visual_noise_row(noise, 3, n, luminance.data(), luminance.data(), cones.data(), rods.data(), scratch.data());
    for (const auto& [row, kind] : {std::pair{&cones, noise.cones}, {&rods, noise.rods}}) {
      const double mean = kind.counts_per_cd_m2 * light + kind.dark_counts;
      const double unit = kind.units_per_count;
      double sum = 0, squares = 0;
      for (const float v : *row) sum += v / unit, squares += v / unit * (v / unit);
      EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(mean / n) + 4e-8 * mean) << light << ": and rounding of the mean to float";
      EXPECT_NEAR(squares / n, mean, 5 * std::sqrt((mean + 2 * mean * mean) / n) + 1e-6 * mean) << light;
    }
  }
}

// Prints the table of isp/render/README.md: a grey of half the white, cells of 0.2 degrees.
TEST(VisualNoise, OfAGreyFallsWithLight) {
  double last_rods = 1e9, last_cones = 1e9;
  for (const double white : {1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0, 100.0, 1e4}) {
    const VisualNoise noise = visual_noise(noise_alone(white));
    const auto contrast = [&](const VisualNoise::Kind& kind, double grey) {
      const double light = kind.counts_per_cd_m2 * grey;
      return std::sqrt(light + kind.dark_counts) / light;
    };
    const double cones = contrast(noise.cones, 0.5 * white), rods = contrast(noise.rods, 1.23 * white);
    std::printf("| %g | %.3g, %.2g | %.2g %% | %.3g, %.4g | %.2g %% |\n", white,
                noise.rods.counts_per_cd_m2 * 1.23 * white, static_cast<double>(noise.rods.dark_counts), 100 * rods,
                noise.cones.counts_per_cd_m2 * 0.5 * white, static_cast<double>(noise.cones.dark_counts), 100 * cones);
    EXPECT_LT(rods, last_rods) << white;
    EXPECT_LT(cones, last_cones) << white;
    last_rods = rods, last_cones = cones;
  }
}

TEST(NightLook, VisualNoiseVanishesByDayWithTheRootOfLight) {
  constexpr int side = 128;
  InlineExecutor executor;
  NightLookGrid maker(4 * side, 4 * side);
  const CameraRgb camera = flat(side, side, {0.5f, 0.5f, 0.5f});
  double last = 0;
  for (const double light : {100.0, 1e4, 1e6}) {
    NightLook look = noise_alone(light);
    look.scene_cd_m2 = 100;  // one pupil
    const double std_dev = std::sqrt(
        moments_of(maker.make(camera.view(), as_it_is, 1, look, std::nullopt, executor).part[LookGrid::base]).variance);
    EXPECT_LT(std_dev, 0.005) << "of white, a code of 8 bits";
    if (last > 0) {
      EXPECT_NEAR(std_dev, last / 10, 0.02 * last / 10) << "dark light adds 1 % at 100 cd/m2";
    }
    last = std_dev;
  }
}

// Pooling keeps the mean, and leaves less variance the darker it is; the noise is pooled like the light.
TEST(NightLook, VisualNoiseIsPooledWithTheLight) {
  constexpr int side = 256;
  InlineExecutor executor;
  NightLookGrid maker(4 * side, 4 * side);
  const CameraRgb camera = flat(side, side, {0.5f, 0.5f, 0.5f});
  for (const double light : {1e-4, 0.01}) {
    NightLook look = noise_alone(light);
    const Moments own =
        moments_of(maker.make(camera.view(), as_it_is, 1, look, std::nullopt, executor).part[LookGrid::base]);
    look.effects.acuity = true;
    const LookGrid grid = maker.make(camera.view(), as_it_is, 1, look, std::nullopt, executor);
    const Moments pooled = moments_of(grid.part[LookGrid::base]);
    const double kept = 1 - part_at(grid, LookGrid::detail, 0, 0);
    EXPECT_NEAR(pooled.mean, 0.5 * kept, 5 * std::sqrt(own.variance / (side * side)) + 1e-6) << light;
    EXPECT_LT(pooled.variance, own.variance) << light;
  }
}

TEST(NightLook, AnotherSeedIsAnotherNoise) {
  InlineExecutor executor;
  NightLookGrid maker(64, 64);
  const CameraRgb camera = flat(16, 16, {0.5f, 0.5f, 0.5f});
  const auto drawn = [&](std::uint64_t seed) {
    NightLook look = noise_alone(0.01);
    look.seed = seed;
    const LookGrid grid = maker.make(camera.view(), as_it_is, 1, look, std::nullopt, executor);
    const PlaneView<const float>& base = grid.part[LookGrid::base];
    return std::vector<float>(base.row(5), base.row(5) + base.width);
  };
  EXPECT_EQ(drawn(1), drawn(1));
  EXPECT_NE(drawn(1), drawn(2));
}

TEST(NightLook, KeepsNoiseBelowItsLimit) {
  InlineExecutor executor;
  NightLookGrid maker(256, 256);
  const CameraRgb camera = flat(64, 64, {0.004f, 0.004f, 0.004f});
  Plane<float> variance(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) variance.at(x, y) = x < 32 ? 1e-10f : 1e-4f;
  }
  NightLook look = rec709_look(100);
  look.effects = {false, false, false, false, false, false};
  const LookGrid grid =
      maker.make(std::as_const(camera).view(), as_it_is, 1, look, NoiseLimit{2, 1, variance.view()}, executor);
  EXPECT_NEAR(part_at(grid, LookGrid::detail, 4, 30), 1, 1e-6) << "clean: as it was";
  const double gain = part_at(grid, LookGrid::detail, 60, 30);
  EXPECT_LT(gain, 0.5);
  EXPECT_NEAR(part_at(grid, LookGrid::chroma, 60, 30), gain, 1e-6) << "colours keep their hue";
}

// L* and tone curves as they are, against the bound's closed form.
TEST(GainWithinNoiseLimit, HoldsForTheToneCurvesOfTheHouse) {
  const auto lightness_slope = [](double y) { return y > 216.0 / 24389 ? 116 / 3.0 * std::pow(y, -2 / 3.0) : 903.3; };
  for (int i = 0; i < 40; ++i) {
    const double y = i == 0 ? 0 : 0.18 * std::pow(10.0, -0.1 * i);
    for (int j = 0; j < 40; ++j) {
      const double noise = 0.1 * std::pow(10.0, -0.1 * j);
      const double gain = gain_within_noise_limit(y, noise, 2);
      ASSERT_TRUE(gain >= 0 && gain <= 1);
      const double x = gain * y;
      const double toe = x * (0.7 + 0.3 * x / 0.18), slope = 0.7 + 0.6 * x / 0.18;
      ASSERT_LE(lightness_slope(toe) * slope * gain * noise, 2 * (1 + 1e-5)) << y << " " << noise;
      ASSERT_LE(lightness_slope(x) * gain * noise, 2 * (1 + 1e-5));
    }
  }
  EXPECT_EQ(gain_within_noise_limit(0.1, 0, 2), 1);
}

TEST(NightLook, IsFiniteForAnyLight) {
  InlineExecutor executor;
  NightLookGrid maker(64, 64);
  std::mt19937 random(1);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const std::array<float, 8> values{0, -1, 1, 1e30f, -1e30f, nan, infinity, -infinity};
  CameraRgb camera(16, 16);
  for (Plane<float>& plane : camera.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = values[random() % values.size()];
  }
  for (const double light : {1e-7, 1.0, 1e9}) {
    NightLook look = rec709_look(light);
    look.effects.glare = look.effects.visual_noise = true;
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    for (const PlaneView<const float>& part : grid.part) {
      for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) ASSERT_TRUE(std::isfinite(part.at(x, y)));
      }
    }
  }
}

TEST(NightLook, GivesTheSameGridWithAnyNumberOfThreads) {
  CameraRgb camera(61, 47);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(-0.1f, 1);
  for (Plane<float>& plane : camera.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = value(random);
  }
  NightLook look = rec709_look(0.02);
  look.effects.glare = look.effects.visual_noise = true;
  std::vector<float> first;
  for (const int threads : {1, 2, 3, 7}) {
    PoolExecutor executor(threads);
    NightLookGrid maker(300, 200);
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    std::vector<float> all;
    for (const PlaneView<const float>& part : grid.part) {
      for (int y = 0; y < part.height; ++y) all.insert(all.end(), part.row(y), part.row(y) + part.width);
    }
    if (first.empty()) first = all;
    ASSERT_EQ(all, first) << threads;
  }
}

// The kernel's table against the model in double, over all the light and all the S/P fields are held to.
TEST(EyeRow, EqualsTheModelAtEverySP) {
  InlineExecutor executor;
  NightLookGrid maker(4, 4);
  double worst_fraction = 0, worst_chroma = 0;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-5, 3), log_ratio(std::log(0.27), std::log(60.0));
  for (int i = 0; i < 2000; ++i) {
    const double light = std::pow(10.0, exponent(random)), ratio = std::exp(log_ratio(random));
    NightLook look = rec709_look(light);
    look.scotopic_ratio_of_white = ratio;
    const CameraRgb camera = flat(1, 1, {1, 1, 1});
    const LookGrid grid = maker.make(std::as_const(camera).view(), as_it_is, 1, look, std::nullopt, executor);
    const NightEye eye = night_eye({light, ratio * light});
    const double rods = (1 - eye.state.m) * scotopic_at_555_nm * ratio;
    worst_fraction =
        std::max(worst_fraction, std::fabs(part_at(grid, LookGrid::rod_fraction, 0, 0) - rods / (eye.state.m + rods)));
    worst_chroma = std::max(worst_chroma, std::fabs(part_at(grid, LookGrid::chroma, 0, 0) - eye.chroma));
  }
  RecordProperty("worst_share", std::to_string(worst_fraction));
  EXPECT_LT(worst_fraction, 0.02);  // a lookup of m is off by that where m leaves 0 (spec 1.2)
  EXPECT_LT(worst_chroma, 0.01);
}

TEST(Grid, HalvesAndInterpolatesWithoutAnEdge) {
  InlineExecutor executor;
  for (const int width : {1, 2, 5, 8}) {
    Plane<float> fine(width, 3), coarse(halved(width), 2), back(width, 3);
    std::fill_n(fine.data(), fine.size(), 2.5f);
    halve(fine.view(), coarse.view(), executor);
    interpolate_twice(coarse.view(), back.view(), executor);
    for (std::size_t i = 0; i < back.size(); ++i) EXPECT_EQ(back.data()[i], 2.5f);
  }
  Plane<float> ramp(16, 2), half(8, 1), again(16, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 16; ++x) ramp.at(x, y) = static_cast<float>(x);
  }
  halve(ramp.view(), half.view(), executor);
  interpolate_twice(half.view(), again.view(), executor);
  for (int x = 1; x < 15; ++x) EXPECT_FLOAT_EQ(again.at(x, 0), static_cast<float>(x)) << "lines stay lines";
}

TEST(Grid, BlursToTheVarianceAskedForAndKeepsTheSum) {
  InlineExecutor executor;
  for (const double std_cells : {0.7, 2.0, 5.0}) {
    Plane<float> plane(101, 101), scratch(101, 101);
    std::fill_n(plane.data(), plane.size(), 0.0f);
    plane.at(50, 50) = 1;
    blur(plane.view(), std_cells, scratch.view(), executor);
    double sum = 0, second = 0;
    for (int y = 0; y < 101; ++y) {
      for (int x = 0; x < 101; ++x) {
        sum += plane.at(x, y);
        second += plane.at(x, y) * (x - 50) * (x - 50);
      }
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_NEAR(second, std_cells * std_cells, 0.04 * std_cells * std_cells) << "cut at three standard deviations";
  }
}

}  // namespace
}  // namespace lowlux::isp
