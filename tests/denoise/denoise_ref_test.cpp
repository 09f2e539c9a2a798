#include "tests/reference/denoise_ref.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/denoise/frames.h"

namespace lowlux::denoise_ref_test {
namespace {

using namespace denoise_testing;
using denoise::DenoiseOptions;
using denoise::Level;

constexpr double no_prior = std::numeric_limits<double>::infinity();

double rms_error(const Plane<double>& got, const Camera& camera, const Scene& scene) {
  double sum = 0;
  for (int y = 0; y < got.height(); ++y) {
    for (int x = 0; x < got.width(); ++x) sum += std::pow(got.at(x, y) - mean_e(camera, scene, x, y), 2);
  }
  return std::sqrt(sum / static_cast<double>(got.size()));
}

// Bright and without noise, every coefficient of a sine is either kept or below 3 sqrt(v) / 8 of its amplitude: what is
// lost is at most that over each of the few coefficients of a block, i.e. less than one noise standard deviation.
TEST(DenoiseReference, LosesLessThanTheNoiseOfANoiselessPicture) {
  const Camera camera{.dark_e = {2, 2, 2, 2}, .read_noise_e = 1};
  const Scene scene = waves(200);
  Plane<float> raw(96, 80);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 96; ++x) raw.at(x, y) = static_cast<float>(mean_e(camera, scene, x, y) + 2);
  }
  const auto out = reference::denoise({raw.view(), camera.phase}, camera.noise(), {.rho = no_prior});
  EXPECT_LT(rms_error(out.signal_e, camera, scene), std::sqrt(200 + 2 + 1));
}

TEST(DenoiseReference, EachLevelIsNearerToTheTruthThanTheLast) {
  const Camera camera{.dark_e = {20, 20, 20, 20}, .read_noise_e = 2};
  const Scene scene = waves(20);
  const auto raw = exposed(camera, scene, 128, 96, 3);
  double last = std::sqrt(20 + 20 + 4) / 2;  // half of the noise there is
  for (const Level level : {Level::draft, Level::standard, Level::high}) {
    const auto out = reference::denoise({raw.view(), camera.phase}, camera.noise(), {.level = level});
    const double error = rms_error(out.signal_e, camera, scene);
    EXPECT_LT(error, last);
    last = error;
  }
}

TEST(DenoiseReference, GivesAConstantWithoutNoiseBack) {
  const Camera camera{.dark_e = {5, 4, 4, 3}, .white_gain = {2, 1, 1.5}};
  Plane<float> raw(37, 22);
  for (int y = 0; y < 22; ++y) {
    for (int x = 0; x < 37; ++x)
      raw.at(x, y) = static_cast<float>(mean_e(camera, flat(7, 9, 4), x, y) + camera.dark_e[site_of(x, y)]);
  }
  const auto out = reference::denoise({raw.view(), camera.phase}, camera.noise(),
                                      {.white_gain = camera.white_gain, .rho = no_prior});
  EXPECT_LT(rms_error(out.signal_e, camera, flat(7, 9, 4)), 1e-9);  // double
}

}  // namespace
}  // namespace lowlux::denoise_ref_test
