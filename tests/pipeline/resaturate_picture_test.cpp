#include "isp/pipeline/finished/resaturate_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/base/random/random.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

const Xyz dark{0.02, 0.021, 0.03};

SceneLinear filled(int width, int height, const Xyz& colour) {
  SceneLinear out(width, height);
  const std::array values{colour.x, colour.y, colour.z};
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(out.plane[k].data(), out.plane[k].size(), static_cast<float>(values[k]));
  }
  return out;
}

ResaturateOptions exact_to_xyz() {
  ResaturateOptions options;
  options.black = dark;
  options.chroma_noise = 0;
  options.space = OutputSpace::xyz;
  options.samples = SampleType::f32;
  return options;
}

TEST(ResaturatePicture, GivesBackTheChromaticityThatDarkTook) {
  const Xyz light{0.05, 0.04, 0.02};
  auto out = resaturate_picture(filled(24, 16, {light.x + dark.x, light.y + dark.y, light.z + dark.z}), exact_to_xyz(),
                                one_thread);
  const auto& xyz = std::get<SceneLinear>(out.picture);
  const auto got = xy_of(Xyz{xyz.plane[0].at(9, 9), xyz.plane[1].at(9, 9), xyz.plane[2].at(9, 9)});
  const auto expected = xy_of(light);
  ASSERT_TRUE(got);
  EXPECT_NEAR(got->x, expected->x, 1e-5);  // float samples
  EXPECT_NEAR(got->y, expected->y, 1e-5);
  EXPECT_NEAR(xyz.plane[1].at(9, 9), light.y + dark.y, 1e-6) << "luminance stays";
  EXPECT_EQ(out.fraction_dark, 0);
  EXPECT_EQ(out.fraction_saturated, 0);
}

TEST(ResaturatePicture, WhatIsNoBrighterThanBlackBecomesGrey) {
  const auto out = resaturate_picture(filled(24, 16, {0.01, 0.02, 0.005}), exact_to_xyz(), one_thread);
  const auto& xyz = std::get<SceneLinear>(out.picture);
  const auto got = xy_of(Xyz{xyz.plane[0].at(3, 3), xyz.plane[1].at(3, 3), xyz.plane[2].at(3, 3)});
  ASSERT_TRUE(got);
  EXPECT_NEAR(got->x, white_d65.x, 1e-6);
  EXPECT_EQ(out.fraction_dark, 1);
}

TEST(ResaturatePicture, SaturatedPixelsStayAsTheyAre) {
  const Xyz white{0.9505, 1, 1.089};
  const auto out = resaturate_picture(filled(8, 8, white), exact_to_xyz(), one_thread);
  EXPECT_EQ(out.fraction_saturated, 1);
  EXPECT_EQ(std::get<SceneLinear>(out.picture).plane[2].at(4, 4), static_cast<float>(white.z));
}

TEST(ResaturatePicture, NoiseMakesItBelieveLess) {
  const Xyz light{0.05, 0.04, 0.02};
  ResaturateOptions noisy = exact_to_xyz();
  noisy.chroma_noise = 0.05;
  const auto picture = [&](const ResaturateOptions& options) {
    auto out =
        resaturate_picture(filled(24, 16, {light.x + dark.x, light.y + dark.y, light.z + dark.z}), options, one_thread);
    const auto& xyz = std::get<SceneLinear>(out.picture);
    return xy_of(Xyz{xyz.plane[0].at(9, 9), xyz.plane[1].at(9, 9), xyz.plane[2].at(9, 9)})->x - white_d65.x;
  };
  EXPECT_GT(picture(exact_to_xyz()), 2 * picture(noisy));
  EXPECT_GE(picture(noisy), 0);
}

TEST(ResaturatePicture, DisplayCodesAreWithinTheGamut) {
  ResaturateOptions options = exact_to_xyz();
  options.space = OutputSpace::srgb;
  options.samples = SampleType::u8;
  const auto out = resaturate_picture(filled(16, 16, {0.03, 0.03, 0.2}), options, one_thread);
  const auto& codes = std::get<Encoded8>(out.picture).codes;
  EXPECT_GT(codes.at(2, 5), codes.at(0, 5)) << "blue";
}

TEST(ChromaNoise, IsThatOfThePicture) {
  constexpr int size = 1024;
  constexpr double noise = 0.01;
  SceneLinear picture = filled(size, size, {0.3, 0.3, 0.3});
  std::vector<float> normal(size);
  for (std::size_t k = 0; k < 3; ++k) {
    for (int y = 0; y < size; ++y) {
      normal_row({.seed = 3 + k}, 0, static_cast<std::uint32_t>(y), 1, normal);
      for (int x = 0; x < size; ++x) picture.plane[k].at(x, y) += static_cast<float>(noise) * normal[x];
    }
  }
  // X - x0 S has variance noise^2 ((1 - x0)^2 + 2 x0^2), Y - y0 S likewise.
  const auto part = [](double c) { return std::sqrt((1 - c) * (1 - c) + 2 * c * c); };
  const double expected = noise * (part(white_d65.x) + part(white_d65.y)) / 2;
  // The median of a tenth of the 16384 squares of 8 pixels has a relative standard error of 1.17 / sqrt(1638) = 2.9 %.
  constexpr double error = 0.029;
  EXPECT_NEAR(chroma_noise_of(std::as_const(picture).view(), 0), expected, 5 * error * expected);
  // Bright texture, and a black corner without noise at the level of the black point, change nothing.
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const bool is_black = x < size / 4 && y < size / 2, is_texture = x >= size / 2;
      for (std::size_t k = 0; k < 3; ++k) {
        float& value = picture.plane[k].at(x, y);
        if (is_black) value = 0.05F;
        if (is_texture) value *= k == 0 && (x + y) % 3 == 0 ? 3.0F : 2.0F;
      }
    }
  }
  EXPECT_NEAR(chroma_noise_of(std::as_const(picture).view(), 0.151), expected, 5 * error * expected);
  const SceneLinear pixel = filled(1, 1, dark);
  EXPECT_EQ(chroma_noise_of(pixel.view(), 0), 0);
}

}  // namespace
}  // namespace lowlux::isp
