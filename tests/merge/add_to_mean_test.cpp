#include "isp/merge/add_to_mean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "tests/merge/merge_scene.h"
#include "tests/support/executors.h"

namespace lowlux::merge {
namespace {

/// Returns the displacements of a frame that is turned about the middle of a scene, and shifted.
Motion turned(int width, int height, double angle, double dx_px, double dy_px) {
  Motion out = no_motion(width, height);
  for (int j = 0; j < out.dx_px.height(); ++j) {
    for (int i = 0; i < out.dx_px.width(); ++i) {
      const double x = out.spacing_px * i - width / 2.0, y = out.spacing_px * j - height / 2.0;
      out.dx_px.at(i, j) = static_cast<float>(dx_px - angle * y);
      out.dy_px.at(i, j) = static_cast<float>(dy_px + angle * x);
    }
  }
  return out;
}

/// Returns the mean square of the weights of drops over the square of their mean, where displacements are uniform: by
/// the autocorrelation of the tent, a cubic spline, at the distances of a colour's samples.
double square_of_weights(double radius_px, bool green) {
  const auto correlation = [&](int distance_px) {
    const double d = std::fabs(distance_px) / radius_px;
    if (d >= 2) return 0.0;
    return radius_px * (d < 1 ? 2.0 / 3 - d * d + d * d * d / 2 : std::pow(2 - d, 3) / 6);
  };
  double sum = 0;
  for (int j = -4; j <= 4; ++j) {
    for (int i = -4; i <= 4; ++i) {
      if (green ? (i + j) % 2 != 0 : i % 2 != 0 || j % 2 != 0) continue;
      sum += correlation(i) * correlation(j);
    }
  }
  return (green ? 2 : 4) * sum / std::pow(radius_px, 4);
}

TEST(AddDrops, TheNoiseThatUnequalWeightsAddIsThatOfUniformDisplacements) {
  EXPECT_NEAR(square_of_weights(1, false), 16.0 / 9, 1e-12);
  constexpr int side = 400;
  const Plane<float> frame = test::flat_mosaic(side, side, 0);
  for (const double radius : {1.0, 1.25, 1.5, 2.0}) {
    MosaicMean mean(side, side);
    const auto noise = add_drops(frame.view(), BayerPhase::bggr, turned(side, side, 0.05, 0.3, 0.1), {}, radius, {},
                                 mean, test::one_thread);
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = square_of_weights(c == 1 ? radius : std::max(radius, 4.0 / 3), c == 1);
      EXPECT_NEAR(noise[c], expected, 0.02) << radius << ", colour " << c;  // drops at the border hold fewer samples
    }
  }
}

// White noise of variance 1 in 12 frames, of whose mean sums over windows of 32 x 32 sites are measured, for each
// colour apart: their variance over that of one sample for each site and frame is what add_drops returns. Windows
// overlap by half, so that four of them count as at least two.
TEST(AddDrops, TheNoiseOfLargerAreasIsAsStated) {
  constexpr int side = 320, border = 32, window = 32, frames = 12, seeds = 8;
  const Plane<float> dark = test::flat_mosaic(side, side, 0);
  std::array<double, window> weight{};
  for (int i = 0; i < window; ++i) weight[i] = std::pow(std::sin((i + 0.5) / window * std::numbers::pi), 2);
  for (const double radius : {1.0, 1.5}) {
    for (const double turn : {0.0, 4e-4}) {
      SCOPED_TRACE(testing::Message() << "radius " << radius << ", turn " << turn);
      std::array<double, 3> squares{}, expected{}, stated{};
      int windows = 0;
      for (int seed = 0; seed < seeds; ++seed) {
        MosaicMean mean(side, side);
        for (int i = 0; i < frames; ++i) {
          const Plane<float> noise = test::noisy_frame(dark, 0, 1, seed, i);
          const Motion motion = turned(side, side, turn * (i - 5), 0.37 * i, -0.61 * i);
          const auto factor =
              add_drops(noise.view(), BayerPhase::grbg, motion, {}, radius, {}, mean, test::two_threads);
          for (std::size_t c = 0; c < 3; ++c) stated[c] += factor[c] / (frames * seeds);
        }
        const Plane<float> values = mean.take_mean(test::one_thread);
        for (int top = border; top + window <= side - border; top += window / 2) {
          for (int left = border; left + window <= side - border; left += window / 2, ++windows) {
            std::array<double, 3> sum{};
            for (int y = 0; y < window; ++y) {
              for (int x = 0; x < window; ++x) {
                const auto colour = static_cast<std::size_t>(colour_at(BayerPhase::grbg, left + x, top + y));
                sum[colour] += weight[x] * weight[y] * static_cast<double>(values.at(left + x, top + y));
                expected[colour] += std::pow(weight[x] * weight[y], 2) / frames;
              }
            }
            for (std::size_t c = 0; c < 3; ++c) squares[c] += sum[c] * sum[c];
          }
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(squares[c] / expected[c] / stated[c], 1, 5 * std::sqrt(2 / (0.5 * windows)) + 0.02)
            << "colour " << c;
        EXPECT_GE(stated[c], 1);
      }
    }
  }
}

/// Returns a prediction that is linear in the place, so that interpolation is exact.
RgbPlanes<struct PredictionDomain> linear_prediction(int width, int height, double slope) {
  RgbPlanes<struct PredictionDomain> out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.plane[c] = Plane<float>(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        out.plane[c].at(x, y) = static_cast<float>(20.0 * static_cast<double>(c + 1) + slope * (x - 0.5 * y));
      }
    }
  }
  return out;
}

/// Draws the displacement of a frame.
using DrawShift = std::function<std::array<double, 2>(std::mt19937_64&)>;

double uniform(std::mt19937_64& draw, double largest) {
  return std::uniform_real_distribution<double>(-largest, largest)(draw);
}

double whole(std::mt19937_64& draw, int largest) { return std::uniform_int_distribution<int>(-largest, largest)(draw); }

// White noise of variance 1 around a linear prediction, in 15 and 31 frames: sums over windows of 32 x 32 pixels have
// the stated variance, whether or not the displacements cover the pixels in all colours. What unequal weights add is
// not stated: up to a quarter of the variance, where displacements are few or small.
TEST(AddColourDrops, TheNoiseIsAsStatedForAllDisplacements) {
  constexpr int side = 288, border = 48, window = 32, seeds = 4;
  const Plane<float> dark = test::flat_mosaic(side, side, 0);
  const auto prediction = linear_prediction(side, side, 0.25);
  std::array<double, window> weight{};
  for (int i = 0; i < window; ++i) weight[i] = std::pow(std::sin((i + 0.5) / window * std::numbers::pi), 2);
  struct Case {
    const char* name;
    DrawShift shift;
    double turn = 0;
  };
  const std::array cases{Case{"none",
                              [](auto&) {
                                return std::array{0.0, 0.0};
                              }},
                         Case{"whole cells",
                              [](auto& draw) {
                                return std::array{2 * whole(draw, 4), 2 * whole(draw, 4)};
                              }},
                         Case{"whole pixels",
                              [](auto& draw) {
                                return std::array{whole(draw, 9), whole(draw, 9)};
                              }},
                         Case{"half a pixel",
                              [](auto&) {
                                return std::array{0.5, 0.5};
                              }},
                         Case{"multiples of half a pixel",
                              [](auto& draw) {
                                return std::array{whole(draw, 9) / 2, whole(draw, 9) / 2};
                              }},
                         Case{"along x",
                              [](auto& draw) {
                                return std::array{uniform(draw, 10), 0.0};
                              }},
                         Case{"0.05 px",
                              [](auto& draw) {
                                return std::array{uniform(draw, 0.05), uniform(draw, 0.05)};
                              }},
                         Case{"0.3 px",
                              [](auto& draw) {
                                return std::array{uniform(draw, 0.3), uniform(draw, 0.3)};
                              }},
                         Case{"10 px",
                              [](auto& draw) {
                                return std::array{uniform(draw, 10), uniform(draw, 10)};
                              }},
                         Case{"10 px, turned",
                              [](auto& draw) {
                                return std::array{uniform(draw, 10), uniform(draw, 10)};
                              },
                              2e-2}};
  for (const Case& of : cases) {
    for (const int frames : {15, 31}) {
      std::array<double, 3> squares{}, expected{}, sum{};
      int windows = 0;
      for (int seed = 0; seed < seeds; ++seed) {
        std::mt19937_64 draw(static_cast<std::uint64_t>(seed));
        ColourMean mean(side, side);
        for (int i = 0; i < frames; ++i) {
          const Plane<float> noise = test::noisy_frame(dark, 0, 1, seed, i);
          const auto [dx, dy] = of.shift(draw);
          add_colour_drops(noise.view(), BayerPhase::gbrg, turned(side, side, uniform(draw, of.turn), dx, dy),
                           prediction.view(), {}, mean, test::two_threads);
        }
        const std::array<double, 3> variance = mean.variance(test::two_threads);
        const ColourMean::Image image = mean.image({0, side}, variance, prediction.view(), test::two_threads);
        for (int top = border; top + window <= side - border; top += window / 2) {
          for (int left = border; left + window <= side - border; left += window / 2, ++windows) {
            std::array<double, 3> of_window{};
            double pixels = 0;
            for (int y = 0; y < window; ++y) {
              for (int x = 0; x < window; ++x) {
                const double w = weight[x] * weight[y];
                pixels += w * w;
                for (std::size_t c = 0; c < 3; ++c) {
                  of_window[c] +=
                      w * static_cast<double>(image.samples.at(3 * (left + x) + static_cast<int>(c), top + y) -
                                              prediction.plane[c].at(left + x, top + y));
                }
              }
            }
            const double ratio =
                image.noise_ratio.ratio.at((left + window / 2) / block_px, (top + window / 2) / block_px);
            for (std::size_t c = 0; c < 3; ++c) {
              squares[c] += of_window[c] * of_window[c];
              sum[c] += of_window[c];
              expected[c] += variance[c] * ratio * pixels;
            }
          }
        }
      }
      std::printf("%s, %d frames: variance over that stated", of.name, frames);
      // Windows overlap by half, so that four of them count as at least two.
      const double standard_error = std::sqrt(2 / (0.5 * windows));
      for (std::size_t c = 0; c < 3; ++c) {
        std::printf(" %.3f", squares[c] / expected[c]);
        EXPECT_GT(squares[c] / expected[c], 0.97 - 5 * standard_error) << of.name << ", colour " << c;
        EXPECT_LT(squares[c] / expected[c], 1.2 + 5 * standard_error) << of.name << ", colour " << c;
        EXPECT_NEAR(sum[c] / std::sqrt(expected[c]), 0, 5 * std::sqrt(2.0)) << of.name << ", colour " << c;
      }
      std::printf("\n");
    }
  }
}

TEST(AddColourDrops, BlocksWithoutFramesKeepThePrediction) {
  constexpr int width = 61, height = 37;
  const auto prediction = linear_prediction(width, height, 0.25);
  const Plane<float> ones = [&] {
    Plane<float> out(width, height);
    std::fill_n(out.data(), out.size(), 1.0F);
    return out;
  }();
  Plane<std::uint8_t> matches((width + block_px - 1) / block_px, (height + block_px - 1) / block_px);
  std::fill_n(matches.data(), matches.size(), std::uint8_t{1});
  matches.at(2, 1) = 0;
  ColourMean mean(width, height);
  for (int i = 0; i < 60; ++i) {
    add_colour_drops(ones.view(), BayerPhase::rggb, turned(width, height, 0, 0.31 * i - 9, 0.23 * i - 7),
                     prediction.view(), matches.view(), mean, test::one_thread);
  }
  const std::array<double, 3> variance = mean.variance(test::one_thread);
  const ColourMean::Image all = mean.image({0, height}, variance, prediction.view(), test::one_thread);
  for (int y = 1; y < height - 1; ++y) {  // border pixels have samples of fewer colours
    for (int x = 1; x < width - 1; ++x) {
      const bool is_left_out = x / block_px == 2 && y / block_px == 1;
      for (int c = 0; c < 3; ++c) {
        const float more = all.samples.at(3 * x + c, y) - prediction.plane[static_cast<std::size_t>(c)].at(x, y);
        EXPECT_NEAR(static_cast<double>(more), is_left_out ? 0 : 1, 1e-4) << x << ' ' << y << ' ' << c;
      }
    }
  }
  EXPECT_EQ(all.noise_ratio.ratio.at(2, 1), 1.0F / 64);
  EXPECT_GT(all.noise_ratio.ratio.at(3, 1), 0.3F);
  // A strip of rows holds the same values.
  const ColourMean::Image strip = mean.image({16, height}, variance, prediction.view(), test::one_thread);
  for (int y = 16; y < height; ++y) {
    for (int x = 0; x < 3 * width; ++x) ASSERT_EQ(strip.samples.at(x, y - 16), all.samples.at(x, y));
  }
  for (int i = 0; i < all.noise_ratio.ratio.width(); ++i) {
    EXPECT_EQ(strip.noise_ratio.ratio.at(i, 0), all.noise_ratio.ratio.at(i, 2));
  }
}

}  // namespace
}  // namespace lowlux::merge
