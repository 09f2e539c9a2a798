#include "denoise/denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include "tests/denoise/frames.h"
#include "tests/reference/denoise_ref.h"

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

double scale_of(const Plane<float>& raw) {
  double most = 1;
  for (std::size_t i = 0; i < raw.size(); ++i) most = std::max(most, std::abs(static_cast<double>(raw.data()[i])));
  return most;
}

void expect_near(PlaneView<const float> got, PlaneView<const double> expected, double tolerance,
                 const std::string& what) {
  double worst = 0;
  int at_x = 0, at_y = 0;
  for (int y = 0; y < got.height; ++y) {
    for (int x = 0; x < got.width; ++x) {
      const double difference = std::abs(static_cast<double>(got.at(x, y)) - expected.at(x, y));
      if (!(difference <= worst)) {
        worst = difference;
        at_x = x;
        at_y = y;
      }
    }
  }
  EXPECT_LE(worst, tolerance) << what << " at " << at_x << ", " << at_y;
}

// A sample passes through about 60 float operations in each of two passes and five levels, each of a relative error of
// at most 2^-24 of the largest value there is: 600 * 2^-24 = 4e-5 if all of them agreed in sign.
void compare(const Camera& camera, const Plane<float>& raw, const DenoiseOptions& options) {
  const int columns = (raw.width() + 1) / 2, rows = (raw.height() + 1) / 2;
  Plane<float> signal(raw.width(), raw.height()), residual(columns, rows), confidence(columns, rows);
  InlineExecutor one;
  denoise::Denoiser denoiser(raw.width(), raw.height(), 1);
  denoiser.run({raw.view(), camera.phase}, camera.noise(), options, signal.view(), {residual.view(), confidence.view()},
               one);
  const auto expected = reference::denoise({raw.view(), camera.phase}, camera.noise(), options);
  const double scale = scale_of(raw) * *std::max_element(options.white_gain.begin(), options.white_gain.end());
  expect_near(signal.view(), expected.signal_e.view(), 4e-5 * scale, "signal");
  expect_near(residual.view(), expected.residual_variance.view(), 4e-5 * scale, "residual");
  expect_near(confidence.view(), expected.chroma_confidence.view(), 1e-3, "confidence");
}

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

}  // namespace
}  // namespace lowlux
