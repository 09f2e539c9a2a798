// Noise that differs from place to place in flat frames: what is left, what is predicted, what is taken for stars.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "denoise/check/noise_check.h"
#include "denoise/denoiser.h"
#include "tests/denoise/draws.h"
#include "tests/denoise/mixed_frames.h"
#include "tests/denoise/searcher.h"

namespace lowlux::noise_ratio_flats_test {
namespace {

using namespace denoise_testing;
using denoise::Level;

/// What the squares of a checkered flat frame show: sums over periods of the pattern.
struct Squares {
  test::MeanOf step;             // mean of single squares less that of the others
  test::MeanOf across_border_2;  // squared difference of neighbours of one colour in squares of different noise
  test::MeanOf inside_2;         // in squares of a single frame
  test::MeanOf value;
};

Squares squares_of(const Plane<float>& got, const Mixed& frame, int px) {
  Squares out;
  for (int top = 0; top + 2 * px <= got.height(); top += 2 * px) {
    for (int left = 0; left + 2 * px <= got.width(); left += 2 * px) {
      double step = 0;
      for (int y = top; y < top + 2 * px; ++y) {
        for (int x = left; x < left + 2 * px; ++x) {
          const auto value = static_cast<double>(got.at(x, y));
          step += frame.is_single(x, y) ? value : -value;
          out.value.add(value);
          if (x < 2) continue;
          const double difference = value - static_cast<double>(got.at(x - 2, y));
          if (frame.is_single(x, y) != frame.is_single(x - 2, y)) {
            out.across_border_2.add(difference * difference);
          } else if (frame.is_single(x, y)) {
            out.inside_2.add(difference * difference);
          }
        }
      }
      out.step.add(step / (2 * px * px));
    }
  }
  return out;
}

/// The difference of neighbours across the borders of squares that is not visible, over that of a single frame's noise.
double max_border(Level level) {
  return level == Level::draft ? 0.038 : level == Level::standard ? 0.031 : level == Level::high ? 0.026 : 0.01;
}

// The amplitude of the pattern itself is 0 within its standard error, neighbours across the borders of squares differ
// by a few hundredths of the noise (blocks across a border have the mean of its variances, and leave more on its
// noisier side), and the mean is the mosaic's.
TEST(NoiseRatioFlats, ShowsNoSquaresInFlats) {
  constexpr int width = 1024, height = 768;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  for (const double e : {0.5, 5.0, 50.0}) {
    for (const int blocks : {1, 2, 8}) {
      const Mixed frame = mixed(camera, flat(e, e, e), width, height, 8, 8, checked(blocks), 41);
      const double variance_e2 = e + 2 + camera.read_noise_e * camera.read_noise_e;
      const double mean_error_e = std::sqrt((variance_e2 + variance_e2 / 8) / 2 / (width * height));
      for (const Level level : denoise::all_levels) {
        if (level == Level::best && blocks != 2) continue;
        const auto got = denoised(frame.both, camera, view_of(&frame.ratio), {.level = level});
        const Squares found = squares_of(got, frame, 8 * blocks);
        const double border = std::sqrt(found.across_border_2.mean() / (2 * variance_e2));
        std::printf("%4.1f e- %2d px %-9s step %+.5f +- %.5f, border over noise %.4f, over inside %.3f\n", e,
                    8 * blocks, std::string(name_of(level)).c_str(), found.step.mean(), found.step.standard_error(),
                    border, std::sqrt(found.across_border_2.mean() / found.inside_2.mean()));
        EXPECT_LT(std::abs(found.step.mean()), 5 * found.step.standard_error());
        EXPECT_LT(border, max_border(level));
        EXPECT_LT(std::abs(found.value.mean() - e), 5 * mean_error_e);
      }
    }
  }
}

// As for frames of one noise (DenoiserFlats), in each half, 64 cells from its borders.
TEST(NoiseRatioFlats, PredictsTheResidualOfEachHalf) {
  constexpr int side = 1024, margin = 64;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  for (const double e : {1.0, 100.0}) {
    const Mixed frame = mixed(
        camera, flat(e, e, e), 2 * side, side, 8, 8, [](int i, int) { return i >= side / 8; }, 43);
    for (const Level level : {Level::draft, Level::standard, Level::high}) {
      Plane<float> out(2 * side, side), residual(side, side / 2);
      InlineExecutor one;
      denoise::Denoiser denoiser(2 * side, side, 1);
      denoiser.run({frame.both.view(), camera.phase, view_of(&frame.ratio)}, camera.noise(), {.level = level},
                   out.view(), {residual.view(), {}, {}}, one);
      for (const int half : {0, 1}) {
        test::MeanOf squared, predicted;
        for (int y = margin; y < side / 2 - margin; ++y) {
          for (int x = half * side / 2 + margin; x < (half + 1) * side / 2 - margin; ++x) {
            const auto site = [&](int i, int j) { return static_cast<double>(out.at(2 * x + i, 2 * y + j)) - e; };
            squared.add(std::pow(0.2 * (site(0, 0) + site(1, 1)) + 0.3 * (site(1, 0) + site(0, 1)), 2));
            predicted.add(static_cast<double>(residual.at(x, y)));
          }
        }
        const double ratio = std::sqrt(predicted.mean() / squared.mean());
        EXPECT_GT(ratio, 0.9) << name_of(level) << " at " << e << ", half " << half;
        EXPECT_LT(ratio, 1.15) << name_of(level) << " at " << e << ", half " << half;
      }
    }
  }
}

/// A mosaic in units of 1 / frames electrons, in which means are as Poisson counts, and single frames are not.
Mixed in_units_of_means(Mixed frame, int frames) {
  const auto n = static_cast<float>(frames);
  for (Plane<float>* plane : {&frame.both, &frame.ratio.ratio}) {
    for (std::size_t i = 0; i < plane->size(); ++i) plane->data()[i] *= n;
  }
  return frame;
}

Camera in_units_of_means(Camera camera, int frames) {
  for (double& dark : camera.dark_e) dark *= frames;
  camera.read_noise_e *= std::sqrt(frames);
  return camera;
}

// As PointSources.AreFoundInFlatNoiseInLessThanOneCellInAMillion.
TEST(NoiseRatioFlats, MakesNoPointSourcesOfNoise) {
  constexpr int side = 1500, frames = 8;
  Searcher search(side);
  struct Case {
    double signal_e, dark_e, read_noise_e;
  };
  for (const Case c : {Case{0, 0.3, 1}, Case{0.5, 2, 1.5}, Case{20, 2, 1.5}, Case{4, 200, 4}}) {
    const Camera camera{.dark_e = {c.dark_e, c.dark_e, c.dark_e, c.dark_e}, .read_noise_e = c.read_noise_e};
    for (const int blocks : {1, 4}) {
      Mixed frame =
          mixed(camera, flat(c.signal_e, 2 * c.signal_e, c.signal_e), side, side, frames, 8, checked(blocks), 45);
      const double expected = 1e-6 * side * side / 4, most = 9 * (expected + 5 * std::sqrt(expected));
      EXPECT_LE(static_cast<double>(marked(search(frame.both, camera, view_of(&frame.ratio)))), most) << c.signal_e;
      frame = in_units_of_means(std::move(frame), frames);
      const auto cells = search(frame.both, in_units_of_means(camera, frames), view_of(&frame.ratio));
      EXPECT_LE(static_cast<double>(marked(cells)), most) << c.signal_e << " in units of means";
    }
  }
}

// Stars of the same significance for the noise of their place, inside of squares of one block of ratio each.
TEST(NoiseRatioFlats, KeepsStarsInSinglesAndInMeans) {
  constexpr int side = 640, frames = 8, square = 8, pitch = 64;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const double variance_e2 = std::pow(cell_sigma_e(camera, 5), 2);
  Mixed frame = mixed(camera, flat(5, 5, 5), side, side, frames, 8, checked(square), 46);
  std::array<double, 2> flux{}, sum{};
  for (const int single : {0, 1}) flux[single] = 12 * std::sqrt(variance_e2 / (single == 1 ? 1 : frames));
  const auto for_stars = [&](const auto& work) {
    for (int y = pitch / 2; y < side; y += pitch) {
      for (int x = pitch / 2; x < side; x += pitch) work(x, y, frame.is_single(x, y) ? 1 : 0);
    }
  };
  for_stars([&](int x, int y, int single) {
    for (int i = 0; i < 4; ++i) frame.both.at(x + i % 2, y + i / 2) += static_cast<float>(flux[single] / 4);
  });
  const auto got = denoised(frame.both, camera, view_of(&frame.ratio), {.level = Level::standard});
  for_stars([&](int x, int y, int single) {
    for (int i = 0; i < 36; ++i) sum[single] += static_cast<double>(got.at(x - 2 + i % 6, y - 2 + i / 6)) - 5;
  });
  constexpr double stars = 50;  // of each kind, with the noise of 9 cells: 5 standard errors are 5 * 3 / (12 sqrt(50))
  for (const int single : {0, 1}) EXPECT_NEAR(sum[single] / stars / flux[single], 1, 0.18) << single;
}

TEST(NoiseRatioFlats, MakesTheNoiseOfAMixedFrameAgreeWithItsModel) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  PoolExecutor pool(2);
  for (const int blocks : {1, 2, 8}) {
    const Mixed frame = mixed(camera, flat(20, 30, 10), 1024, 768, 8, 8, checked(blocks), 47);
    const auto check =
        denoise::check_noise({frame.both.view(), camera.phase, view_of(&frame.ratio)}, camera.noise(), pool);
    for (int l = 0; l < denoise::max_levels; ++l) {
      // A tenth of the blocks, 8 at least, of 48 details each; where blocks hold both kinds, half as many count.
      const double count = std::max(8.0, 64.0 * 48 / 10 / (1 << (2 * l)));
      EXPECT_NEAR(check.measured_over_model[l].value(), 1, 5 * std::sqrt(2 / (24 * count)) + 0.02) << blocks << l;
    }
    EXPECT_TRUE(denoise::remarks_on(check).empty());
  }
  const Mixed frame = mixed(camera, flat(20, 30, 10), 1024, 768, 8, 8, checked(8), 47);
  EXPECT_LT(denoise::check_noise({frame.both.view(), camera.phase}, camera.noise(), pool).measured_over_model[0], 0.3);
}

}  // namespace
}  // namespace lowlux::noise_ratio_flats_test
