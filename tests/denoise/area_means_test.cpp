#include "denoise/spatial/area_means.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "tests/denoise/flat_charts.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::DenoiseOptions;
using denoise::Level;

constexpr int patch_px = 64;
constexpr int square_px = 2 * denoise::mean_square;

/// Flat patches of random colours of 4 e- on average, each colour 0.5 to 7.5 e-.
Scene patches(int side_px, int offset_px = 0) {
  return [=](int x, int y) {
    const auto column = static_cast<std::uint32_t>((x + offset_px) / side_px);
    const auto row = static_cast<std::uint32_t>((y + offset_px) / side_px);
    const PhiloxWords words = words_at({.seed = 81}, column, row);
    const auto e = [&](std::size_t i) { return 0.5 + 7 * (words[i] / 4294967296.0); };
    return std::array{e(0), e(1), e(2)};
  };
}

/// Sums of products of the colours of patches, each less the mean of its three colours.
struct Slope {
  double product = 0, square = 0;

  void add(const std::array<double, 3>& got, const std::array<double, 3>& truth) {
    const double grey = (truth[0] + truth[1] + truth[2]) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
      product += got[k] * (truth[k] - grey);
      square += truth[k] * (truth[k] - grey);
    }
  }
  double value() const { return product / square; }
};

Slope slope_of(const Plane<float>& got, const Camera& camera, const Scene& scene, int side_px, int first_px,
               int margin_px) {
  Slope out;
  const int size = side_px - 2 * margin_px;
  for (int y = first_px + margin_px; y + size <= got.height(); y += side_px) {
    for (int x = first_px + margin_px; x + size <= got.width(); x += side_px) {
      out.add(colour_means(got.view().crop(x, y, size, size), camera.phase), scene(x, y));
    }
  }
  return out;
}

// The raw means of patches have a standard error of sigma / 32 for R and B, which the slope divides by the root of the
// sum of squares of colours. Without keep_means the slope is 0.79 to 0.85.
TEST(AreaMeans, PatchesOfFaintColoursKeepTheirColour) {
  const Camera camera = camera_over(230);
  const Scene scene = patches(patch_px);
  const auto raw = exposed(camera, scene, 1024, 768, 82);
  for (const Level level : levels_for_flats()) {
    const DenoiseOptions shrunk{.level = level, .rho = no_prior};
    DenoiseOptions kept = shrunk;
    kept.keep_means = true;
    const Denoised out(raw, camera, kept);
    const Slope slope = slope_of(out.signal, camera, scene, patch_px, 0, 0);
    const double without = slope_of(Denoised(raw, camera, shrunk).signal, camera, scene, patch_px, 0, 0).value();
    const double error = std::sqrt((7.5 + 230 + 16) / (patch_px * patch_px / 4.0) / slope.square);
    std::printf("%-8s slope of colours %.3f, without means %.3f\n", std::string(name_of(level)).c_str(), slope.value(),
                without);
    EXPECT_NEAR(slope.value(), 1, 5 * error) << name_of(level);
    EXPECT_LT(without, 0.9) << name_of(level);
    for (int y = 0; y < raw.height(); y += square_px) {
      for (int x = 0; x < raw.width(); x += square_px) {
        const auto measured = colour_means(raw.view().crop(x, y, square_px, square_px), camera.phase);
        const auto got = colour_means(out.signal.view().crop(x, y, square_px, square_px), camera.phase);
        // Float values of some 300 e- are rounded by 1e-5 e-.
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[k], measured[k] - 230, 1e-3) << x << ", " << y;
      }
    }
  }
}

// By default. Coefficients above thresholds alone keep 0.40 and 0.53 of the colour of patches of 48 pixels, 0.52 and
// 0.64 of 64, 0.71 and 0.79 of 96, 0.77 and 0.84 of 128, with `draft` and `standard`.
TEST(FaintColours, OfPatchesAreKeptWhereTheyExceedTheNoiseTogether) {
  const Camera camera = camera_over(230);
  struct Least {
    int side_px;
    double draft, standard;
  };
  for (const auto& [side_px, draft, standard] :
       {Least{48, 0.47, 0.59}, {64, 0.58, 0.68}, {96, 0.74, 0.81}, {128, 0.81, 0.86}}) {
    const int offset_px = side_px / 10 * 2;
    const Scene scene = patches(side_px, offset_px);
    const auto raw = exposed(camera, scene, 1536, 1024, 82);
    for (const auto& [level, least] : {std::pair{Level::draft, draft}, {Level::standard, standard}}) {
      const Denoised out(raw, camera, {.level = level});
      const double slope = slope_of(out.signal, camera, scene, side_px, side_px - offset_px, 6).value();
      std::printf("%3d px %-8s slope of colours %.3f\n", side_px, std::string(name_of(level)).c_str(), slope);
      EXPECT_GT(slope, least) << side_px << ' ' << name_of(level);
    }
  }
}

// Errors next to a lamp are large in units of its surroundings.
TEST(AreaMeans, LampsDoNotChangeTheirSurroundings) {
  const Camera camera = camera_over(5);
  const Scene scene = [](int x, int y) {
    const double e = x >= 150 && x < 157 && y >= 130 && y < 135 ? 1e6 : 2;
    return std::array{e, e, e};
  };
  const auto raw = exposed(camera, scene, 320, 256, 87);
  const DenoiseOptions shrunk{.rho = no_prior};
  DenoiseOptions kept = shrunk;
  kept.keep_means = true;
  const Denoised without(raw, camera, shrunk), with(raw, camera, kept);
  // Standard error of R and B; values at the centres of squares have at most 2.2 times that.
  const double of_square = std::sqrt((2 + 5 + 16) / (square_px * square_px / 4.0));
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (x >= 134 && x < 173 && y >= 114 && y < 151) continue;
      ASSERT_NEAR(with.signal.at(x, y), without.signal.at(x, y), 5 * 2.2 * of_square) << x << ", " << y;
    }
  }
}

// Patches that do not lie on squares: away from their edges.
TEST(AreaMeans, TheMiddleOfAnyAreaKeepsItsColour) {
  const Camera camera = camera_over(230);
  constexpr int side_px = 110, offset_px = 38, margin_px = 20;
  const Scene scene = patches(side_px, offset_px);
  const auto raw = exposed(camera, scene, 1200, 900, 83);
  const Denoised out(raw, camera, {.rho = no_prior, .keep_means = true});
  const Slope slope = slope_of(out.signal, camera, scene, side_px, side_px - offset_px, margin_px);
  const double raw_slope = slope_of(raw, camera, scene, side_px, side_px - offset_px, margin_px).value();
  std::printf("slope of colours %.3f, of the raw %.3f\n", slope.value(), raw_slope);
  EXPECT_NEAR(slope.value(), raw_slope, 0.05);
}

// Colour is lost next to other colours, and a square spreads it evenly: inside of small patches it is too much where
// they consist of whole squares, and too little where they lie across squares.
TEST(AreaMeans, InsideSmallPatchesTheErrorIsThatOfTheSquares) {
  const Camera camera = camera_over(230);
  constexpr int margin_px = 8;
  for (const auto& [side_px, most] : {std::pair{64, 0.2}, {96, 0.15}, {128, 0.1}, {192, 0.08}}) {
    for (const int offset_px : {0, 12, 20}) {
      const Scene scene = patches(side_px, offset_px);
      const auto raw = exposed(camera, scene, 1184, 896, 89);
      const Denoised out(raw, camera, {.rho = no_prior, .keep_means = true});
      const int first_px = offset_px == 0 ? 0 : side_px - offset_px;
      const double slope = slope_of(out.signal, camera, scene, side_px, first_px, margin_px).value();
      const double raw_slope = slope_of(raw, camera, scene, side_px, first_px, margin_px).value();
      std::printf("patches of %3d px, offset %2d: slope of colours 8 px inside %.3f, of the raw %.3f\n", side_px,
                  offset_px, slope, raw_slope);
      EXPECT_NEAR(slope, raw_slope, most) << side_px << ", " << offset_px;
    }
  }
}

// What is added varies between places, and so does its variance: that of the maps is the mean.
TEST(AreaMeans, TheVarianceIncludesThatOfTheMeans) {
  for (const double dark_e : {2.0, 230.0}) {
    const Camera camera = camera_over(dark_e);
    const auto raw = exposed(camera, flat(4, 6, 5), 1536, 1024, 84);
    const Denoised out(raw, camera, {.rho = no_prior, .keep_means = true});
    Calibration of_frame;
    for (int y = 0; y < 512; ++y) {
      for (int x = 0; x < 768; ++x) of_frame.add(out, x, y, {4, 6, 5});
    }
    std::printf("%g e- dark: predicted over actual std. dev. of L, R, G, B %.3f %.3f %.3f %.3f\n", dark_e,
                of_frame.ratio(0), of_frame.ratio(1), of_frame.ratio(2), of_frame.ratio(3));
    for (int i = 0; i < 4; ++i) {
      EXPECT_GT(of_frame.ratio(i), 0.95) << i;
      EXPECT_LT(of_frame.ratio(i), 1.25) << i;
    }
  }
}

TEST(AreaMeans, FramesOfAnySizeKeepTheirMean) {
  const Camera camera = camera_over(20);
  for (const auto& [width, height] : {std::array{2, 2}, std::array{3, 5}, std::array{31, 70}, std::array{131, 37},
                                      std::array{96, 160}, std::array{257, 511}}) {
    const auto raw = exposed(camera, waves(10), width, height, 85);
    const Denoised out(raw, camera, {.rho = no_prior, .keep_point_sources = false, .keep_means = true});
    const auto measured = colour_means(raw.view(), camera.phase);
    const auto got = colour_means(out.signal.view(), camera.phase);
    // The last cell of an odd row or column has two sites of four, for which its square is not weighted.
    const double tolerance_e = width % 2 != 0 || height % 2 != 0 ? 0.02 : 1e-4;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(got[k], measured[k] - 20, tolerance_e) << width << " x " << height << ", " << k;
    }
  }
}

Plane<float> with_means(const Camera& camera, const Plane<float>& raw, const denoise::RawNoise& noise, bool means,
                        Executor& executor, int threads) {
  Plane<float> out(raw.width(), raw.height());
  denoise::Denoiser(raw.width(), raw.height(), threads)
      .run({raw.view(), camera.phase}, noise, {.white_gain = camera.white_gain, .rho = no_prior, .keep_means = means},
           out.view(), {}, executor);
  return out;
}

TEST(AreaMeans, SaturatedCellsStayAndNeitherTheyNorNanCount) {
  Camera camera = camera_over(230);
  camera.white_gain = {2, 1, 1.5};  // a saturated cell, which becomes neutral, is not as it was measured
  auto raw = exposed(camera, flat(4, 6, 5), 256, 192, 86);
  auto noise = camera.noise();
  noise.saturation_e = {5000, 5000, 5000};
  for (int y = 60; y < 140; ++y) {
    for (int x = 81; x < 171; ++x) raw.at(x, y) = 5000;
  }
  for (int x = 0; x < 256; ++x) raw.at(x, 20) = std::numeric_limits<float>::quiet_NaN();
  InlineExecutor one;
  const auto shrunk = with_means(camera, raw, noise, false, one, 1);
  const auto kept = with_means(camera, raw, noise, true, one, 1);
  for (int y = 60; y < 140; ++y) {
    for (int x = 80; x < 172; ++x) ASSERT_EQ(kept.at(x, y), shrunk.at(x, y)) << x << ", " << y;
  }
  // The mean of a square has a noise of 16 e- / 16, twice as much where a quarter of its sites count, and the values at
  // the centres of squares have at most 2.2 times that.
  for (int y = 0; y < 192; ++y) {
    for (int x = 0; x < 256; ++x) {
      if (x >= 80 && x < 172 && y >= 60 && y < 140) continue;
      ASSERT_LT(std::abs(kept.at(x, y) - shrunk.at(x, y)), 5 * 2 * 2.2f) << x << ", " << y;
    }
  }
}

TEST(AreaMeans, DoNotDependOnTheNumberOfThreads) {
  const Camera camera = camera_over(230);
  const auto raw = exposed(camera, patches(patch_px), 401, 333, 87);
  InlineExecutor one;
  const auto first = with_means(camera, raw, camera.noise(), true, one, 1);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const auto out = with_means(camera, raw, camera.noise(), true, pool, threads);
    EXPECT_EQ(std::memcmp(first.data(), out.data(), out.size() * sizeof(float)), 0) << threads;
  }
}

}  // namespace
}  // namespace lowlux
