#include "denoise/picture/resaturate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "isp/model/colour/dark_desaturation.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::denoise {
namespace {

using isp::Xy;
using isp::Xyz;
using test::nan;

constexpr double eps = std::numeric_limits<double>::epsilon();

Matrix3 srgb() {
  return *inverse(
      *isp::rgb_to_xyz({.red = {0.64, 0.33}, .green = {0.30, 0.60}, .blue = {0.15, 0.06}, .white = isp::white_d65}));
}

TEST(ResaturateXy, IsTheExactInverseAtFullConfidence) {
  const Xy truth{0.55, 0.31}, dark{0.29, 0.34};
  for (const double level : test::steps(-12, 0, 0.5)) {
    const double alpha = std::pow(10.0, level);
    const Xy found = resaturate_xy(isp::desaturated(truth, dark, alpha), dark, alpha, 1, isp::white_d65);
    EXPECT_NEAR(found.x, truth.x, 4 * eps / alpha) << alpha;  // the rounding of the measured one, times 1 / alpha
    EXPECT_NEAR(found.y, truth.y, 4 * eps / alpha) << alpha;
  }
}

TEST(ResaturateXy, ShrinksTheRestoredColourTowardsTheNeutral) {
  const Xy truth{0.55, 0.31}, dark{0.29, 0.34}, neutral = isp::white_d65;
  const Xy measured = isp::desaturated(truth, dark, 0.2);
  for (const double w : {0.0, 0.1, 0.5, 0.9, 1.0}) {
    const Xy found = resaturate_xy(measured, dark, 0.2, w, neutral);
    EXPECT_NEAR(found.x, neutral.x + w * (truth.x - neutral.x), 1e-14) << w;  // rounding, times 5
    EXPECT_NEAR(found.y, neutral.y + w * (truth.y - neutral.y), 1e-14) << w;
  }
}

TEST(ResaturateXy, OfDarkAloneIsTheNeutral) {
  const Xy neutral = isp::white_d65;
  for (const double alpha : {0.0, -0.2, nan, 1e-320}) {
    EXPECT_EQ(resaturate_xy({0.9, 0.05}, {0.3, 0.3}, alpha, 1, neutral), neutral) << alpha;
  }
  EXPECT_EQ(resaturate_xy({nan, 0.05}, {0.3, 0.3}, 0.5, 1, neutral), neutral);
}

/// A picture of rows of colours, each with some of the dark's light in it.
SceneLinear picture_of(const std::vector<Xyz>& colours, const Xyz& dark) {
  SceneLinear out(static_cast<int>(colours.size()), 1);
  for (int x = 0; x < out.width(); ++x) {
    const Vector3 c = isp::vector_of(colours[static_cast<std::size_t>(x)]), d = isp::vector_of(dark);
    for (int k = 0; k < 3; ++k) out.plane[k].at(x, 0) = static_cast<float>(c[k] + d[k]);
  }
  return out;
}

Xyz at(const SceneLinear& picture, int x, int y = 0) {
  return {picture.plane[0].at(x, y), picture.plane[1].at(x, y), picture.plane[2].at(x, y)};
}

SceneLinear resaturated(const SceneLinear& picture, const Resaturation& how) {
  SceneLinear out(picture.width(), picture.height());
  resaturate(picture.view(), how, out.view());
  return out;
}

TEST(Resaturate, RestoresChromaticitiesAndKeepsLuminances) {
  const Xyz dark{0.03, 0.03, 0.04};
  const std::vector<Xyz> truth{{0.4, 0.25, 0.05}, {0.12, 0.2, 0.06}, {0.02, 0.012, 0.05}, {0.004, 0.0025, 0.0005}};
  const SceneLinear picture = picture_of(truth, dark);
  const SceneLinear out = resaturated(picture, {.dark = dark, .radius = 0, .xyz_to_rgb = srgb()});
  for (int x = 0; x < 4; ++x) {
    const Xyz& true_colour = truth[static_cast<std::size_t>(x)];
    const Xy found = *isp::xy_of(at(out, x)), expected = *isp::xy_of(true_colour);
    // Floats of the measured colour, 6e-8 of it, over its signal's share.
    const double error = 4 * 6e-8 / *isp::signal_fraction(true_colour, dark);
    EXPECT_NEAR(found.x, expected.x, error) << x;
    EXPECT_NEAR(found.y, expected.y, error) << x;
    EXPECT_EQ(out.plane[1].at(x, 0), picture.plane[1].at(x, 0));
  }
}

TEST(Resaturate, WithoutDarkAndNoiseChangesNothingInsideTheGamut) {
  const SceneLinear picture = picture_of({{0.4, 0.25, 0.05}, {0.12, 0.2, 0.06}, {9.5, 10, 10.9}}, {});
  const SceneLinear out = resaturated(picture, {.xyz_to_rgb = srgb()});
  for (int x = 0; x < 3; ++x) {
    EXPECT_NEAR(at(out, x).x / at(picture, x).x, 1, 2e-7) << x;  // float
    EXPECT_NEAR(at(out, x).z / at(picture, x).z, 1, 4e-7) << x;
  }
}

TEST(Resaturate, TakesAlphaFromTheNeighbourhood) {
  const Xyz dark{1, 1, 1};
  const SceneLinear picture = picture_of({{1.2, 1.0, 0.8}, {3.6, 3, 2.4}}, dark);
  const SceneLinear out = resaturated(picture, {.dark = dark, .neutral = isp::white_e, .radius = 1});
  const double alpha = 6.0 / 9;  // mean signal of both
  const Xy measured = *isp::xy_of(at(picture, 0));
  EXPECT_NEAR(isp::xy_of(at(out, 0))->x, 1.0 / 3 + (measured.x - 1.0 / 3) / alpha, 1e-6);
}

TEST(Resaturate, GainIsBoundedByPriorAndNoise) {
  const Xyz dark{1, 1, 1};
  Resaturation how{.dark = dark, .neutral = isp::white_e, .chroma_noise = 0.05, .radius = 0};
  double largest = 0;
  for (const double f : test::ratios(1e-5, 1e3, 1.2)) {
    const SceneLinear picture = picture_of({{1.1 * f, 1.0 * f, 0.9 * f}}, dark);
    const Xy before = *isp::xy_of(at(picture, 0)), after = *isp::xy_of(at(resaturated(picture, how), 0));
    if (before.x - 1.0 / 3 < 1e-5) continue;  // floats
    const double gain = (after.x - 1.0 / 3) / (before.x - 1.0 / 3);
    const double sum = at(picture, 0).x + at(picture, 0).y + at(picture, 0).z;
    EXPECT_LE(gain, sum * how.prior_std / (2 * how.chroma_noise) * 1.01) << f;  // 1 %: floats of the difference
    largest = std::max(largest, gain / (sum * how.prior_std / (2 * how.chroma_noise)));
  }
  EXPECT_GT(largest, 0.95);  // and the bound is met
}

TEST(Resaturate, KeepsTheGamutAlongTheLineToTheNeutral) {
  const Matrix3 to_rgb = srgb();
  const Xyz dark{0.5, 0.5, 0.55};
  // Too little of the dark is in the colour: undone, it lies far outside.
  const SceneLinear picture = picture_of({{0.3, 0.12, 0.05}, {0.05, 0.3, 0.05}, {0.04, 0.02, 0.4}}, {0.4, 0.41, 0.43});
  Resaturation how{.dark = dark, .radius = 0, .xyz_to_rgb = to_rgb};
  const SceneLinear out = resaturated(picture, how);
  int moved = 0;
  for (int x = 0; x < 3; ++x) {
    const Vector3 rgb = to_rgb * isp::vector_of(at(out, x));
    const double smallest = std::min({rgb[0], rgb[1], rgb[2]});
    EXPECT_GT(smallest, -1e-6 * at(out, x).y) << x;  // floats, times a matrix of entries up to 3.2
    EXPECT_EQ(out.plane[1].at(x, 0), picture.plane[1].at(x, 0));
    const Xy found = *isp::xy_of(at(out, x)), measured = *isp::xy_of(at(picture, x)), black = *isp::xy_of(dark);
    const double sum = at(picture, x).x + at(picture, x).y + at(picture, x).z;
    const Xy asked = resaturate_xy(measured, black, (sum - 1.55) / sum, 1, how.neutral);
    const double cross =
        (found.x - how.neutral.x) * (asked.y - how.neutral.y) - (found.y - how.neutral.y) * (asked.x - how.neutral.x);
    EXPECT_NEAR(cross / std::hypot(asked.x - how.neutral.x, asked.y - how.neutral.y), 0, 1e-6) << x;
    if (smallest < 1e-6) ++moved;
  }
  EXPECT_GE(moved, 1);
}

TEST(Resaturate, WithoutSignalIsNeutralOfTheSameLuminance) {
  const Xyz dark{0.3, 0.25, 0.45};
  const SceneLinear picture = picture_of({{0, 0, 0}, {-0.1, -0.1, -0.1}, {-1, -1, -1}, {-0.3, -0.25, -0.45}}, dark);
  const SceneLinear out = resaturated(picture, {.dark = dark, .radius = 0, .xyz_to_rgb = srgb()});
  for (int x = 0; x < 4; ++x) {
    const double y = picture.plane[1].at(x, 0);
    EXPECT_EQ(out.plane[1].at(x, 0), picture.plane[1].at(x, 0));
    EXPECT_NEAR(out.plane[0].at(x, 0), y * 0.3127 / 0.3290, 1e-7) << x;
    EXPECT_NEAR(out.plane[2].at(x, 0), y * 0.3583 / 0.3290, 1e-7) << x;
  }
}

TEST(Resaturate, LeavesSaturatedPixelsAloneAndOutOfTheMeans) {
  const Xyz dark{1, 1, 1};
  const SceneLinear picture = picture_of({{1.2, 1, 0.8}, {1000, 900, 1100}, {1.2, 1, 0.8}}, dark);
  Plane<std::uint8_t> saturated(3, 1);
  for (int x = 0; x < 3; ++x) saturated.at(x, 0) = x == 1;
  Resaturation how{.dark = dark, .neutral = isp::white_e, .radius = 2};
  how.saturated = std::as_const(saturated).view();
  const SceneLinear out = resaturated(picture, how);
  EXPECT_EQ(out.plane[0].at(1, 0), picture.plane[0].at(1, 0));
  EXPECT_EQ(out.plane[2].at(1, 0), picture.plane[2].at(1, 0));
  EXPECT_NEAR(isp::xy_of(at(out, 0))->x, 0.4, 1e-6);
}

TEST(Resaturate, OfFiniteValuesMakesNoneThatIsNotAndPassesTheOthersOn) {
  const float values[] = {-3e38f, -1, -1e-38f, 0, 1e-45f, 1e-20f, 0.01f, 1, 1e10f, 3e38f};
  SceneLinear picture(10, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 10; ++x) {
      picture.plane[0].at(x, y) = values[x];
      picture.plane[1].at(x, y) = values[y % 10];
      picture.plane[2].at(x, y) = values[y / 10];
    }
  }
  for (const double noise : {0.0, 1e-3}) {
    for (const int radius : {0, 3}) {
      const SceneLinear out = resaturated(
          picture, {.dark = {0.01, 0.01, 0.01}, .chroma_noise = noise, .radius = radius, .xyz_to_rgb = srgb()});
      for (const auto& plane : out.plane) {
        for (std::size_t i = 0; i < plane.size(); ++i) ASSERT_TRUE(std::isfinite(plane.data()[i])) << i;
      }
    }
  }
  picture.plane[2].at(4, 7) = static_cast<float>(nan);
  const SceneLinear out = resaturated(picture, {.dark = {0.01, 0.01, 0.01}, .radius = 1});
  EXPECT_TRUE(std::isnan(out.plane[2].at(4, 7)));
  EXPECT_EQ(out.plane[0].at(4, 7), picture.plane[0].at(4, 7));
  EXPECT_TRUE(std::isfinite(out.plane[2].at(5, 7)));
  EXPECT_EQ(resaturated(SceneLinear(), {}).width(), 0);
}

TEST(Resaturate, MayWorkInPlace) {
  const Xyz dark{1, 1, 1};
  SceneLinear picture = picture_of({{1.2, 1.0, 0.8}, {3.6, 3, 2.4}}, dark);
  const Resaturation how{.dark = dark, .radius = 1};
  const SceneLinear apart = resaturated(picture, how);
  resaturate(std::as_const(picture).view(), how, picture.view());
  for (int x = 0; x < 2; ++x) EXPECT_EQ(picture.plane[0].at(x, 0), apart.plane[0].at(x, 0));
}

}  // namespace
}  // namespace lowlux::denoise
