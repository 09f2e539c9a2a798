#include "isp/bench/peers/nl_means.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

constexpr int width = 48, height = 40;

SceneLinear ramp() {
  SceneLinear out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      out.plane[0].at(x, y) = 0.1f + 0.01f * static_cast<float>(x);
      out.plane[1].at(x, y) = 0.3f;
      out.plane[2].at(x, y) = 0.1f + 0.01f * static_cast<float>(y);
    }
  }
  return out;
}

Encoded8 noisy_codes() {
  const SceneLinear clean = ramp();
  Encoded8 out = codes_of(clean.view());
  std::vector<float> normal(static_cast<std::size_t>(3 * width));
  for (int y = 0; y < height; ++y) {
    normal_row({.seed = 1, .purpose = draw_purpose::scene}, 0, static_cast<std::uint32_t>(y), 0, normal);
    for (int x = 0; x < 3 * width; ++x) {
      const double code = out.codes.at(x, y) + 15 * static_cast<double>(normal[static_cast<std::size_t>(x)]);
      out.codes.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(code), 0L, 255L));
    }
  }
  return out;
}

TEST(NlMeans, CodesAndLightAreInverseOfEachOther) {
  Encoded8 codes{Plane<std::uint8_t>(3 * 256, 1)};
  for (int x = 0; x < 3 * 256; ++x) codes.codes.at(x, 0) = static_cast<std::uint8_t>(x / 3);
  const SceneLinear linear = linear_of(codes);
  const Encoded8 back = codes_of(linear.view());
  EXPECT_EQ(std::memcmp(back.codes.data(), codes.codes.data(), codes.codes.size()), 0);
  EXPECT_EQ(linear.plane[0].at(255, 0), 1);
  EXPECT_EQ(linear.plane[2].at(0, 0), 0);
}

// What makes the search honest: the steps it takes apart are those of OpenCV's own function, to the last code.
TEST(NlMeans, ItsStepsTogetherAreOpenCvsFunction) {
  const NlMeans& nl_means = *lowlux_nl_means();
  Encoded8 noisy = noisy_codes();
  Encoded8 whole{Plane<std::uint8_t>(3 * width, height)}, joined{Plane<std::uint8_t>(3 * width, height)};
  const NlMeansPicture from{noisy.codes.data(), width, height};
  ASSERT_TRUE(nl_means.denoise(from, {whole.codes.data(), width, height}, 20, 10));
  constexpr std::size_t pixels = static_cast<std::size_t>(width) * height;
  std::vector<std::uint8_t> lightness(pixels), colour(2 * pixels), smooth_lightness(pixels), smooth_colour(2 * pixels);
  ASSERT_TRUE(nl_means.split(from, lightness.data(), colour.data()));
  ASSERT_TRUE(nl_means.filter(lightness.data(), smooth_lightness.data(), width, height, 1, 20));
  ASSERT_TRUE(nl_means.filter(colour.data(), smooth_colour.data(), width, height, 2, 10));
  ASSERT_TRUE(nl_means.join(smooth_lightness.data(), smooth_colour.data(), {joined.codes.data(), width, height}));
  EXPECT_EQ(std::memcmp(whole.codes.data(), joined.codes.data(), whole.codes.size()), 0);
  EXPECT_NE(std::memcmp(whole.codes.data(), noisy.codes.data(), whole.codes.size()), 0);
}

TEST(NlMeans, TheSearchFindsTheBestOfAllStrengths) {
  const NlMeans& nl_means = *lowlux_nl_means();
  Encoded8 noisy = noisy_codes();
  InlineExecutor one;
  const SceneLinear clean = ramp();
  const PictureTruth truth(clean.view(), one);
  const StrengthSearch found = search_strength(nl_means, noisy, truth);
  ASSERT_GT(found.runs, 0);
  Encoded8 out{Plane<std::uint8_t>(3 * width, height)};
  const auto psnr = [&](double lightness, double colour) {
    EXPECT_TRUE(
        nl_means.denoise({noisy.codes.data(), width, height}, {out.codes.data(), width, height}, lightness, colour));
    const SceneLinear display = linear_of(out);
    return encoded_psnr_db(display.view(), truth, one);
  };
  EXPECT_NEAR(psnr(found.best.lightness, found.best.colour), found.psnr_db, 1e-4);  // dB: float codes
  for (const double lightness : {0.5, 4.0, 16.0, 64.0, 256.0}) {
    for (const double colour : {0.5, 4.0, 16.0, 64.0, 256.0}) EXPECT_LE(psnr(lightness, colour), found.psnr_db + 1e-4);
  }
}

TEST(NlMeans, AFilterThatFailsIsASearchWithoutRuns) {
  NlMeans broken = *lowlux_nl_means();
  broken.filter = [](const std::uint8_t*, std::uint8_t*, int, int, int, double) noexcept { return false; };
  InlineExecutor one;
  const SceneLinear clean = ramp();
  EXPECT_EQ(search_strength(broken, noisy_codes(), PictureTruth(clean.view(), one)).runs, 0);
  broken = *lowlux_nl_means();
  broken.split = [](const NlMeansPicture&, std::uint8_t*, std::uint8_t*) noexcept { return false; };
  EXPECT_EQ(search_strength(broken, noisy_codes(), PictureTruth(clean.view(), one)).runs, 0);
}

TEST(NlMeans, APictureOfNoSizeIsRefused) {
  std::uint8_t byte = 0;
  EXPECT_FALSE(lowlux_nl_means()->denoise({&byte, 0, 0}, {&byte, 0, 0}, 10, 10));
}

}  // namespace
}  // namespace lowlux::isp
