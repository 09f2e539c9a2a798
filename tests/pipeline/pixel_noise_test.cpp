#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/pipeline/render/pixel_noise_reducer.h"
#include "tests/denoise/frames.h"
#include "tests/pipeline/pixel_frames.h"
#include "tests/support/executors.h"

// Noise reduction of frames that are no mosaics.
namespace lowlux::isp::pixel_noise_test {
namespace {

using denoise::Level;
using denoise_testing::exposed;
using denoise_testing::flat;
using denoise_testing::Scene;
using pixel_testing::at;
using pixel_testing::channel_e;
using pixel_testing::developed;
using pixel_testing::full_e;
using pixel_testing::layouts;
using pixel_testing::lines;
using pixel_testing::options_of;
using pixel_testing::pixel_frame;
using pixel_testing::read_e;
using test::one_thread;
using test::two_threads;

const SceneLinear& picture_of(const Developed& out) { return std::get<SceneLinear>(out.picture); }

/// Mean and variance of a colour [e-], away from the border.
std::pair<double, double> moments(const Developed& out, std::size_t c) {
  const auto& plane = picture_of(out).plane[c];
  double sum = 0, squares = 0;
  int count = 0;
  for (int y = 8; y < plane.height() - 8; ++y) {
    for (int x = 8; x < plane.width() - 8; ++x, ++count) {
      const double e = full_e * static_cast<double>(plane.at(x, y));
      sum += e;
      squares += e * e;
    }
  }
  return {sum / count, squares / count - sum / count * sum / count};
}

/// Mean square error [e-^2] of all colours.
double error_e2(const Developed& out, SensorLayout layout, const Scene& scene) {
  double sum = 0;
  const SceneLinear& picture = picture_of(out);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto& plane = picture.plane[c];
    const int truth = layout == SensorLayout::monochrome ? 1 : static_cast<int>(c);
    for (int y = 0; y < plane.height(); ++y) {
      for (int x = 0; x < plane.width(); ++x) {
        sum += std::pow(full_e * static_cast<double>(plane.at(x, y)) - channel_e(scene, x, y, truth), 2);
      }
    }
  }
  return sum / 3 / static_cast<double>(picture.plane[0].size());
}

// The mean of eight flats has a standard error of 0.036 % at 20 e- of three colours.
TEST(PixelNoise, FlatsKeepTheirMeanAndLoseTheirNoise) {
  for (const SensorLayout layout : layouts) {
    for (const double mean_e : {20.0, 200.0, 2000.0}) {
      for (const Level level : {Level::draft, Level::standard, Level::high}) {
        std::array<double, 3> mean{};
        for (std::uint64_t seed = 1; seed <= 8; ++seed) {
          const RawFrame frame = pixel_frame(layout, flat(mean_e, mean_e, mean_e), 256, 256, seed);
          const Developed after = developed(frame, at(level));
          for (std::size_t c = 0; c < 3; ++c) {
            const auto [mean_of_one, variance] = moments(after, c);
            mean[c] += mean_of_one / 8;
            EXPECT_LT(variance / (mean_e + read_e * read_e), 0.05) << static_cast<int>(layout) << ' ' << mean_e;
          }
        }
        for (const double colour : mean)
          EXPECT_NEAR(colour / mean_e, 1, 0.002) << static_cast<int>(layout) << ' ' << mean_e;
      }
    }
  }
}

// Halves of green have the variance of their model, no covariance, and the sum that was measured.
TEST(PixelNoise, HalvesOfGreenAreTwoMeasurements) {
  constexpr int side = 400;
  constexpr double mean_e = 50;
  Plane<float> green = exposed({.read_noise_e = read_e}, flat(mean_e, mean_e, mean_e), side, side, 20261126);
  const PlaneView<const float> view = std::as_const(green).view();
  const std::array<PlaneView<const float>, 3> planes{view, view, view};
  Plane<float> cells(2 * side, 2 * side);
  make_cells(planes, {.cell_e = parts_of_colours, .half_variance_e2 = read_e * read_e / 2}, cells.view(), one_thread);
  double first = 0, second = 0, both = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double a = cells.at(2 * x + 1, 2 * y), b = cells.at(2 * x, 2 * y + 1);
      ASSERT_NEAR(a + b, green.at(x, y), 1e-4);
      first += (a - mean_e / 2) * (a - mean_e / 2);
      second += (b - mean_e / 2) * (b - mean_e / 2);
      both += (a - mean_e / 2) * (b - mean_e / 2);
    }
  }
  constexpr double count = side * side, variance = mean_e / 2 + read_e * read_e / 2;
  const double tolerance = 5 * std::sqrt(2 / count);  // no fourth moment here is above that of a normal variable
  EXPECT_NEAR(first / count / variance, 1, tolerance);
  EXPECT_NEAR(second / count / variance, 1, tolerance);
  EXPECT_NEAR(both / count / variance, 0, tolerance);
}

TEST(PixelNoise, ErrorsFallAndDetailStays) {
  for (const SensorLayout layout : layouts) {
    for (const double mean_e : {20.0, 200.0, 2000.0}) {
      const Scene scene = lines(mean_e);
      const RawFrame frame = pixel_frame(layout, scene, 256, 256, 5);
      const double before = error_e2(developed(frame, {}), layout, scene);
      for (const Level level : denoise::all_levels) {
        const double gain_db = 10 * std::log10(before / error_e2(developed(frame, at(level)), layout, scene));
        RecordProperty("gain " + std::to_string(static_cast<int>(layout)) + " " + std::to_string(mean_e) + " " +
                           std::string(denoise::name_of(level)),
                       std::to_string(gain_db));
        EXPECT_GT(gain_db, mean_e < 100 ? 5 : 2)
            << static_cast<int>(layout) << ' ' << mean_e << ' ' << denoise::name_of(level);
      }
    }
  }
}

// The cells of a frame with two independent greens of half the charge each are an ordinary mosaic: what the denoiser
// makes of both must agree in error, or the greens of a pixel would not be what they are taken for.
TEST(PixelNoise, OneGreenIsAsGoodAsTwoHalves) {
  constexpr int side = 192;
  const Scene scene = lines(60);
  double of_pixels = 0, sum = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const RawFrame frame = pixel_frame(SensorLayout::linear_rgb, scene, side, side, 40 + seed);
    of_pixels += error_e2(developed(frame, at(Level::standard)), SensorLayout::linear_rgb, scene);
    const Scene halves = [&](int x, int y) {
      const auto e = scene(x / 2, y / 2);
      return std::array{e[0], e[1] / 2, e[2]};
    };
    Plane<float> cells = exposed({.read_noise_e = read_e}, halves, 2 * side, 2 * side, 60 + seed);
    const Plane<float> quiet = exposed({.read_noise_e = read_e / std::sqrt(2)}, halves, 2 * side, 2 * side, 80 + seed);
    for (int y = 0; y < 2 * side; ++y) {
      for (int x = (y + 1) % 2; x < 2 * side; x += 2) cells.at(x, y) = quiet.at(x, y);
    }
    const denoise::RawNoise noise{.variance_e2 = {read_e * read_e, read_e * read_e / 2, read_e * read_e}};
    denoise::DenoiseOptions options{.white_gain = {0.5, 1, 0.5}, .sites_coincide = true};
    Plane<float> signal(2 * side, 2 * side);
    denoise::Denoiser(2 * side, 2 * side, 1)
        .run({std::as_const(cells).view()}, noise, options, signal.view(), {}, one_thread);
    std::array<Plane<float>, 3> out{Plane<float>(side, side), Plane<float>(side, side), Plane<float>(side, side)};
    const std::array<PlaneView<float>, 3> views{out[0].view(), out[1].view(), out[2].view()};
    join_cells(std::as_const(signal).view(), parts_of_colours, views, one_thread);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          sum += std::pow(static_cast<double>(out[c].at(x, y)) - channel_e(scene, x, y, c), 2) / (3 * side * side);
        }
      }
    }
  }
  EXPECT_NEAR(of_pixels / sum, 1, 0.06);
}

// Oracle: the denoiser itself on the cells of the entire frame.
TEST(PixelNoise, IsTheDenoiserOnCells) {
  for (const std::size_t planes : {1U, 3U}) {
    constexpr int width = 150, height = 131;
    NoiseReduction how;
    how.level = Level::standard;
    how.noise.variance_e2 = {4, 2, 4};
    how.cell_e =
        std::array<double, 3>{planes == 3 ? 1000.0 : 260.0, planes == 3 ? 500.0 : 260.0, planes == 3 ? 1000.0 : 260.0};
    std::array<Plane<float>, 3> pixels;
    for (std::size_t c = 0; c < planes; ++c) {
      pixels[c] = exposed({}, lines(50), width, height, c + 1);
      for (std::size_t i = 0; i < pixels[c].size(); ++i) pixels[c].data()[i] /= 1000;
    }
    Plane<float> cells(2 * width, 2 * height), signal(2 * width, 2 * height);
    const std::array<PlaneView<const float>, 3> views{pixels[0].view(), pixels[1].view(), pixels[2].view()};
    CellCharge charge{.cell_e = *how.cell_e};
    if (planes == 3) charge.half_variance_e2 = how.noise.variance_e2[1];
    make_cells(std::span(views).first(planes), charge, cells.view(), one_thread);
    denoise::DenoiseOptions options = how.options;
    options.sites_coincide = true;
    denoise::Denoiser(2 * width, 2 * height, 1)
        .run({std::as_const(cells).view()}, how.noise, options, signal.view(), {}, one_thread);
    NoiseReducer noise(two_threads);
    PixelNoiseReducer(two_threads).run(std::span(pixels).first(planes), how, noise);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const std::array site{signal.at(2 * x, 2 * y), (signal.at(2 * x + 1, 2 * y) + signal.at(2 * x, 2 * y + 1)) / 2,
                              signal.at(2 * x + 1, 2 * y + 1)};
        const auto expected = [&](std::size_t c) { return static_cast<double>(site[c]) / (*how.cell_e)[c]; };
        if (planes == 1) {
          ASSERT_NEAR(pixels[0].at(x, y), (expected(0) + 2 * expected(1) + expected(2)) / 4, 1e-6);
        } else {
          for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(pixels[c].at(x, y), expected(c), 1e-6);
        }
      }
    }
  }
}

// README.md states what tiles may differ by: 3 % of the noise of a value.
TEST(PixelNoise, TilesAgreeWithTheWhole) {
  constexpr int width = 421, height = 389;
  NoiseReduction how;
  how.level = Level::standard;
  how.noise.variance_e2 = {4, 2, 4};
  how.cell_e = std::array<double, 3>{1, 0.5, 1};
  std::array<Plane<float>, 3> whole, tiled;
  for (std::size_t c = 0; c < 3; ++c) {
    whole[c] = exposed({}, lines(50), width, height, c + 1);
    tiled[c] = exposed({}, lines(50), width, height, c + 1);
  }
  NoiseReducer noise(two_threads);
  PixelNoiseReducer(two_threads).run(whole, how, noise);
  PixelNoiseReducer(two_threads, 256).run(tiled, how, noise);
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < whole[c].size(); ++i) {
      sum += std::pow(static_cast<double>(whole[c].data()[i]) - static_cast<double>(tiled[c].data()[i]), 2);
    }
  }
  EXPECT_LT(std::sqrt(sum / (3 * width * height)), 0.03 * std::sqrt(50 + 4));
}

TEST(PixelNoise, SizesOfAllKindsGiveFiniteValuesOnAnyThreads) {
  const auto seed = static_cast<std::uint32_t>(std::random_device{}());
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> log_size(0, std::log(300));
  for (int i = 0; i < 8; ++i) {
    const int width = i == 0 ? 1 : static_cast<int>(std::exp(log_size(draw)));
    const int height = i == 0 ? 1 : static_cast<int>(std::exp(log_size(draw)));
    for (const SensorLayout layout : layouts) {
      const RawFrame frame = pixel_frame(layout, lines(i % 2 == 0 ? 20 : 9000), width, height, seed);
      const Level level = denoise::all_levels[static_cast<std::size_t>(i) % 4];
      const Developed one = developed(frame, at(level)), two = developed(frame, at(level), two_threads);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto &a = picture_of(one).plane[c], &b = picture_of(two).plane[c];
        for (std::size_t k = 0; k < a.size(); ++k) {
          ASSERT_TRUE(std::isfinite(a.data()[k])) << "seed " << seed << ' ' << width << 'x' << height;
          ASSERT_EQ(a.data()[k], b.data()[k]) << "seed " << seed << ' ' << width << 'x' << height;
        }
      }
    }
  }
}

TEST(PixelNoise, SaturatedAndBlackFramesStay) {
  for (const SensorLayout layout : layouts) {
    RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 96, 64, 1);
    std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), static_cast<std::uint16_t>(frame.raw.white_dn[0]));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(moments(developed(frame, at(Level::high)), c).first, full_e, 1);
    const RawFrame black = pixel_frame(layout, flat(0, 0, 0), 96, 64, 2);
    const double tolerance = 5 * read_e / std::sqrt(80 * 48);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(moments(developed(black, at(Level::high)), c).first, 0, tolerance);
  }
}

// A raw that was smoothed before has less noise on fine scales than its profile states.
TEST(PixelNoise, CorrelatedNoiseIsFound) {
  for (const SensorLayout layout : layouts) {
    const RawFrame white = pixel_frame(layout, flat(200, 200, 200), 512, 512, 2);
    RawFrame smooth = pixel_frame(layout, flat(200, 200, 200), 512, 512, 2);
    const int step = planes_of(white.raw);
    for (int y = 0; y < white.raw.dn.height(); ++y) {
      for (int x = 0; x < white.raw.dn.width() - step; ++x) {
        smooth.raw.dn.at(x, y) =
            static_cast<std::uint16_t>((white.raw.dn.at(x, y) + white.raw.dn.at(x + step, y) + 1) / 2);
      }
    }
    const auto scale_of = [](const RawFrame& frame) {
      const auto plan = plan_develop(frame, options_of(at(Level::standard)), one_thread);
      EXPECT_TRUE(plan);
      return plan->noise_reduction.options.variance_scale;
    };
    EXPECT_EQ(scale_of(white), (std::array<double, denoise::max_levels>{1, 1, 1, 1, 1}));
    EXPECT_LT(scale_of(smooth)[0], 0.85);
  }
}

// The sites of cells hold parts of a pixel's charge.
TEST(PixelNoise, WithoutLightIsStatedForPixels) {
  for (const SensorLayout layout : layouts) {
    const RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 64, 64, 3);
    const NoiseReduction noise = plan_develop(frame, options_of(at(Level::draft)), one_thread)->noise_reduction;
    constexpr double quantisation_e2 = 1 / (12 * pixel_testing::dn_per_e * pixel_testing::dn_per_e);
    for (const double variance_e2 : noise.pixel_variance_e2()) {
      EXPECT_NEAR(variance_e2, read_e * read_e + quantisation_e2, 1e-9) << static_cast<int>(layout);
    }
  }
}

TEST(PixelNoise, SaysWhatItDoesNotDo) {
  const RawFrame frame = pixel_frame(SensorLayout::linear_rgb, flat(20, 20, 20), 96, 64, 1);
  RawFrame unknown = pixel_frame(SensorLayout::linear_rgb, flat(20, 20, 20), 96, 64, 1);
  unknown.noise.reset();
  const auto plan = plan_develop(unknown, options_of(at(Level::draft)), one_thread);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::insufficient);
  DevelopOptions within = options_of({.mode = DenoiseChoice::Mode::automatic});
  within.effects.emplace();
  EXPECT_EQ(plan_develop(frame, within, one_thread)->noise_reduction.level, Level::standard);
}

/// Returns the mean code of a flat of these electrons, with the noise of the image limited.
double mean_code(const RawFrame& frame, const DenoiseChoice& denoise, std::optional<double> noise_limit) {
  DevelopOptions options{.exposure_ev = 6};
  options.find_defects = false;
  options.denoise = denoise;
  options.look.noise_limit = noise_limit;
  const Result<Developed> out = develop(frame, options, one_thread);
  EXPECT_TRUE(out) << out.error().message;
  const Plane<std::uint8_t>& picture = std::get<Encoded8>(out->picture).codes;
  double sum = 0;
  for (std::size_t i = 0; i < picture.size(); ++i) sum += picture.data()[i];
  return sum / static_cast<double>(picture.size());
}

// What limits the brightness of shadows is the noise that is left in the image.
TEST(PixelNoise, OfTheImageIsThatWhichIsLeft) {
  for (const SensorLayout layout : layouts) {
    const RawFrame frame = pixel_frame(layout, flat(15, 15, 15), 128, 128, 3);
    const double without = mean_code(frame, at(Level::standard), std::nullopt);
    EXPECT_NEAR(mean_code(frame, at(Level::standard), 3), without, 0.02 * without) << static_cast<int>(layout);
    EXPECT_LT(mean_code(frame, {}, 3), 0.8 * without) << static_cast<int>(layout);
    EXPECT_LT(mean_code(frame, at(Level::standard), 0.05), 0.8 * without) << static_cast<int>(layout);
  }
}

}  // namespace
}  // namespace lowlux::isp::pixel_noise_test
