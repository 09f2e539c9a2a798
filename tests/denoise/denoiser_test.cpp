#include "denoise/denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>

#include "tests/denoise/against_reference.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::DenoiseOptions;
using denoise::Level;

struct Size {
  int width;
  int height;
};

class DenoiserAgainstReference : public testing::TestWithParam<std::tuple<Size, BayerPhase, Level>> {};

TEST_P(DenoiserAgainstReference, AgreesWithinFloatRounding) {
  const auto [size, phase, level] = GetParam();
  const Camera camera{.phase = phase, .dark_e = {10, 12, 11, 9}, .read_noise_e = 1.5};
  const auto raw = exposed(camera, waves(20), size.width, size.height, 7);
  compare(camera, raw, {.level = level, .white_gain = {1.9, 1, 1.4}, .keep_point_sources = false});
}

INSTANTIATE_TEST_SUITE_P(Sizes, DenoiserAgainstReference,
                         testing::Combine(testing::Values(Size{64, 48}, Size{2, 2}, Size{3, 5}, Size{131, 37}),
                                          testing::Values(BayerPhase::rggb, BayerPhase::gbrg),
                                          testing::Values(Level::draft, Level::standard, Level::high)));
INSTANTIATE_TEST_SUITE_P(Phases, DenoiserAgainstReference,
                         testing::Combine(testing::Values(Size{47, 33}),
                                          testing::Values(BayerPhase::grbg, BayerPhase::bggr),
                                          testing::Values(Level::standard)));
INSTANTIATE_TEST_SUITE_P(AllLevels, DenoiserAgainstReference,
                         testing::Combine(testing::Values(Size{600, 280}), testing::Values(BayerPhase::grbg),
                                          testing::Values(Level::standard, Level::high)));

/// Dark on the left, bright on the right: tiles of every chroma start.
Scene dark_to_bright() {
  return [](int x, int y) {
    const double level = 0.2 * std::pow(1000.0, x / 1100.0), wave = 1 + 0.5 * std::sin(0.05 * (x + 2 * y));
    return std::array{level * wave, level, level * (2 - wave)};
  };
}

class DenoiserChromaStart : public testing::TestWithParam<std::optional<int>> {};

TEST_P(DenoiserChromaStart, AgreesWithTheReferenceThatLeavesNothingOut) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, dark_to_bright(), 1100, 290, 11);
  compare(camera, raw, {.level = Level::standard, .chroma_start = GetParam(), .keep_point_sources = false});
}

INSTANTIATE_TEST_SUITE_P(Starts, DenoiserChromaStart, testing::Values(std::nullopt, 0, 1, 2));

TEST(Denoiser, AgreesWithTheReferenceWhereNoiseIsNotWhite) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, waves(20), 300, 200, 13);
  for (const Level level : denoise::all_levels) {
    compare(camera, raw,
            {.level = level,
             .white_gain = {1.9, 1, 1.4},
             .keep_point_sources = false,
             .variance_scale = {0.2, 0.5, 1, 3, 1.5}});
  }
}

// Both greens are one value, whose variance is half of what one of two would have. Level::best chooses among patches
// that are nearly equal, where rounding decides: NlBayesAgainstReference compares it.
TEST(Denoiser, AgreesWithTheReferenceWhereSitesCoincide) {
  const Camera camera{.phase = BayerPhase::rggb, .dark_e = {2, 2, 2, 2}};
  Plane<float> raw = exposed(camera, waves(20), 300, 200, 15);
  for (int y = 0; y < 200; y += 2) {
    for (int x = 0; x < 300; x += 2) {
      raw.at(x + 1, y) = raw.at(x, y + 1) = (raw.at(x + 1, y) + raw.at(x, y + 1)) / 2;
    }
  }
  for (const Level level : {Level::draft, Level::standard, Level::high}) {
    for (const double blue : {0.5, 1.4}) {
      SCOPED_TRACE(std::string(name_of(level)) + ' ' + std::to_string(blue));
      compare(camera, raw,
              {.level = level, .white_gain = {0.8, 1, blue}, .sites_coincide = true, .keep_point_sources = false});
    }
  }
}

// Twice the noise on all levels is twice the variance: gain 2 on values and variances is the same as no gain.
TEST(Denoiser, TakesOneScaleOfAllLevelsForThatOfTheNoise) {
  const Camera camera{.dark_e = {0, 0, 0, 0}, .read_noise_e = 6};
  const auto raw = exposed(camera, flat(0, 0, 0), 200, 150, 14);
  auto twice = camera.noise();
  for (double& variance : twice.variance_e2) variance = 2 * (0.02 + variance) - 0.02;
  Plane<float> one(200, 150), other(200, 150);
  auto negative = raw.clone();  // local means below the floor: variances are 0.02 + read noise^2
  for (std::size_t i = 0; i < negative.size(); ++i) negative.data()[i] -= 50;
  InlineExecutor executor;
  denoise::Denoiser denoiser(200, 150, 1);
  DenoiseOptions options{.keep_point_sources = false};
  denoiser.run({negative.view(), camera.phase}, twice, options, one.view(), {}, executor);
  options.variance_scale.fill(2);
  denoiser.run({negative.view(), camera.phase}, camera.noise(), options, other.view(), {}, executor);
  expect_near(
      one.view(),
      [&] {
        Plane<double> out(200, 150);
        for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = static_cast<double>(other.data()[i]);
        return out;
      }()
          .view(),
      1e-3, 0, "one scale for all");  // [e-]: float, values of 100; a coefficient on its threshold would be 2
}

TEST(Denoiser, AgreesWithTheReferenceWhereSitesAreSaturated) {
  Camera camera{.dark_e = {2, 2, 2, 2}};
  auto raw = exposed(camera, waves(60), 200, 120, 12);
  for (int y = 50; y < 70; ++y) {
    for (int x = 90; x < 130; ++x) raw.at(x, y) = std::min(raw.at(x, y) + 100, 150.0f);
  }
  compare(camera, raw, {.white_gain = {2, 1, 1.5}, .keep_point_sources = false});
  auto noise = camera.noise();
  noise.saturation_e = {140, 149, 145};
  compare(camera, noise, raw, {.white_gain = {2, 1, 1.5}, .keep_point_sources = false});
}

// On the coarsest level: holes within rows, at both their ends, whole rows above, between and below, and nothing else;
// on one level and on four.
TEST(Denoiser, AgreesWithTheReferenceWhereNothingElseIsNear) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto within = [](int at, int size, double from, double to) { return at >= from * size && at < to * size; };
  auto noise = camera.noise();
  noise.saturation_e.fill(500);
  for (const Size size : {Size{61, 27}, Size{300, 160}}) {
    const auto raw = exposed(camera, waves(60), size.width, size.height, 15);
    for (const bool all : {false, true}) {
      auto lit = raw.clone();
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const bool rows =
              within(y, size.height, 0, 0.22) || within(y, size.height, 0.4, 0.6) || within(y, size.height, 0.9, 1);
          const bool columns =
              within(x, size.width, 0, 0.2) || within(x, size.width, 0.4, 0.7) || within(x, size.width, 0.95, 1);
          if (all || rows || (columns && y > size.height / 2)) lit.at(x, y) = 500;
        }
      }
      compare(camera, noise, lit, {.white_gain = {2, 1, 1.5}, .keep_point_sources = false});
    }
  }
}

}  // namespace
}  // namespace lowlux
