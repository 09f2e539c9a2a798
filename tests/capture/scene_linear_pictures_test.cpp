#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "capture/file/picture_source.h"
#include "isp/model/colour/colorimetry.h"
#include "tests/capture/built_pictures.h"
#include "tests/codec/pictures.h"

namespace lowlux::capture {
namespace {

TEST(ReadPicture, FloatsWithALinearProfileHaveItsPrimariesAndWithACurveAreRefused) {
  isp::FileMetadata metadata;
  metadata.icc = bytes_of(rgb_profile({1, 1, 1}));
  const ScenePicture scene = read_good(tiff_of(linear_row({{0, 2, 0}}), metadata));
  expect_near(at(scene.xyz, 0), *isp::rgb_to_xyz(isp::primaries_p3_d65) * Vector3{0, 2, 0}, 1e-4);
  metadata.icc = bytes_of(rgb_profile({1, 1.1, 1}));
  EXPECT_TRUE(has(refused(tiff_of(linear_row({{0, 1, 0}}), metadata)), "linear profile"));
}

TEST(ReadPicture, ChromaticitiesOfOpenExrAreItsPrimariesAndNothingIsAdapted) {
  isp::FileMetadata metadata;  // ACES AP0, SMPTE ST 2065-1, whose blue lies below the colours
  metadata.chromaticities = isp::Chromaticities{{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}};
  const ScenePicture scene = read_good(exr_of(linear_row({{1, 1, 1}, {1, 0, 0}, {0, 0, 3}}), metadata));
  // The matrix of ST 2065-1 section 4.1.2, in its ten figures.
  expect_near(at(scene.xyz, 0), {0.9525523959 + 0.0000936786, 0.3439664498 + 0.7281660966 - 0.0721325464, 1.0088251844},
              float_tolerance);
  expect_near(at(scene.xyz, 1), {0.9525523959, 0.3439664498, 0}, float_tolerance);
  // Y is 3 * -0.0721325464: light of no colour there is, held at 0.
  expect_near(at(scene.xyz, 2), {3 * 0.0000936786, 0, 3 * 1.0088251844}, 1e-6);
}

TEST(ReadPicture, XyzInOpenExrComesBackAsItIs) {
  isp::FileMetadata metadata;
  metadata.chromaticities = isp::Chromaticities{{1, 0}, {0, 1}, {0, 0}, {1.0 / 3, 1.0 / 3}};
  expect_near(at(read_good(exr_of(linear_row({{0.25F, 0.5F, 7}}), metadata)).xyz, 0), {0.25, 0.5, 7}, 3e-6);
}

TEST(ReadPicture, ChromaticitiesThatAreNoSpaceAreRefused) {
  isp::FileMetadata metadata;
  metadata.chromaticities = isp::Chromaticities{{0.2, 0.2}, {0.3, 0.3}, {0.4, 0.4}, {0.3, 0.3}};
  EXPECT_TRUE(has(refused(exr_of(linear_row({{1, 1, 1}}), metadata)), "chromaticities"));
  metadata.chromaticities = isp::Chromaticities{{0.64, 0.33}, {0.3, 0.6}, {0.15, 0.06}, {0.3, 0}};
  EXPECT_TRUE(has(refused(exr_of(linear_row({{1, 1, 1}}), metadata)), "chromaticities"));
}

TEST(ReadPicture, WhiteLuminanceMakesAPictureAbsolute) {
  isp::FileMetadata metadata;
  metadata.white_luminance_cd_m2 = 0.5;
  const ScenePicture scene = read_good(exr_of(linear_row({{1, 1, 1}}), metadata));
  EXPECT_TRUE(scene.absolute);
  EXPECT_EQ(scene.white_luminance_cd_m2, 0.5);
  expect_near(at(scene.xyz, 0), d65, float_tolerance);  // the numbers stay those of the file
  EXPECT_FALSE(read_good(exr_of(linear_row({{1, 1, 1}}))).absolute);
}

TEST(ReadPicture, ValuesThatAreNoNumberAreRefusedWithTheirPixel) {
  for (const float bad : {nan, infinity, -infinity}) {
    SceneLinear picture(5, 7);
    for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size(), 0.5F);
    picture.plane[1].at(3, 5) = bad;
    picture.plane[2].at(0, 6) = bad;
    for (const int threads : {1, 4}) {
      const auto scene = read(exr_of(picture), threads);
      ASSERT_FALSE(scene);
      EXPECT_TRUE(has(scene.error(), "green of the pixel at column 3, row 5 is")) << scene.error().message;
    }
  }
}

TEST(ReadPicture, LightBeyondFloatsIsRefusedWithItsPixel) {
  const float top = std::numeric_limits<float>::max();
  EXPECT_TRUE(has(refused(pfm_of(linear_row({{1, 1, 1}, {top, top, top}}))), "column 1, row 0"));
}

SceneLinear mostly_half(float one_value) {
  SceneLinear picture(2000, 1);
  for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size(), 0.5F);
  picture.plane[2].at(9, 0) = one_value;
  return picture;
}

TEST(ReadPicture, NegativeValuesBecomeZeroWithAWarningThatStatesTheirFraction) {
  SceneLinear picture = mostly_half(-0.06F);
  picture.plane[1].at(9, 0) = -0.03F;
  const ScenePicture scene = read_good(exr_of(picture));
  ASSERT_EQ(scene.warnings.size(), 1u);
  // 2 of 6000 samples; 0.09 of 5998 / 2.
  EXPECT_EQ(scene.warnings[0],
            "0.0333 % of the samples are negative, down to -0.06, 0.003 % of its light: they become 0");
  expect_near(at(scene.xyz, 9), rec709 * Vector3{0.5, 0, 0}, float_tolerance);
}

/// Black and white bars, four pixels wide, four times as large by a Lanczos-3 filter.
SceneLinear enlarged_bars() {
  constexpr int size = 64, factor = 4;
  const auto sinc = [](double x) { return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); };
  SceneLinear picture(size * factor, 1);
  for (int x = 0; x < picture.width(); ++x) {
    const double place = (x + 0.5) / factor - 0.5;
    double sum = 0;
    for (int i = static_cast<int>(std::floor(place)) - 2; i <= static_cast<int>(std::floor(place)) + 3; ++i) {
      const bool white = (i + size) / 4 % 2 == 1;
      if (white && std::fabs(place - i) < 3) sum += sinc(place - i) * sinc((place - i) / 3);
    }
    for (auto& plane : picture.plane) plane.at(x, 0) = static_cast<float>(sum);
  }
  return picture;
}

// What is right: the ringing of any filter in use passes, even at its most; what was never light does not.
TEST(ReadPicture, RingingOfFiltersIsClippedAndADifferenceOfPicturesRefused) {
  const ScenePicture bars = read_good(exr_of(enlarged_bars()));
  ASSERT_EQ(bars.warnings.size(), 1u);
  EXPECT_NE(bars.warnings[0].find("3.5 % of its light"), std::string::npos) << bars.warnings[0];

  SceneLinear difference(64, 1);
  for (auto& plane : difference.plane) {
    for (int x = 0; x < 64; ++x) plane.at(x, 0) = x % 2 == 0 ? 0.01F : -0.01F;
  }
  EXPECT_TRUE(has(refused(exr_of(difference)),
                  "50 % of the samples are negative, down to -0.01, 50 % of its light and more than the 5 % that"));
  EXPECT_TRUE(has(refused(exr_of(linear_row({{-1e-6F, 0, 0}, {0, 0, 0}}))), "100 % of its light"));
}

TEST(ReadPicture, ATwentiethOfTheLightIsTheMostThatIsClipped) {
  // One sample of -v among 5999 of 0.5.
  const float limit = 0.05F / 0.95F * 0.5F * 5999;
  EXPECT_TRUE(read(exr_of(mostly_half(-0.999F * limit))));
  EXPECT_TRUE(has(refused(exr_of(mostly_half(-1.001F * limit))), "clip the image at 0 if that is meant"));
}

TEST(ReadPicture, FlippedBitsAreAnErrorOrAFinitePicture) {
  isp::FileMetadata metadata;
  metadata.icc = bytes_of(rgb_profile({2.2, 2.2, 2.2}));
  metadata.exif = exif_of(6, false);
  metadata.chromaticities = isp::Chromaticities{{0.64, 0.33}, {0.3, 0.6}, {0.15, 0.06}, {0.3127, 0.329}};
  const auto codes = test::noisy_codes<std::uint8_t>(9, 7);
  const SceneLinear light = mostly_half(1);
  std::mt19937 random(11);
  for (const Bytes& valid : {png_of(codes, metadata), jpeg_of(codes, metadata), exr_of(light, metadata), pfm_of(light),
                             tiff_of(test::noisy_codes<std::uint16_t>(9, 7), metadata)}) {
    for (int round = 0; round < 400; ++round) {
      Bytes bytes = valid;
      for (int flips = 1 + round % 4; flips > 0; --flips) {
        bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << (random() % 8));
      }
      const auto scene = read(bytes);
      if (!scene) {
        EXPECT_EQ(scene.error().message.find('\n'), std::string::npos) << scene.error().message;
        continue;
      }
      for (const auto& plane : scene->xyz.plane) {
        EXPECT_TRUE(std::all_of(plane.data(), plane.data() + plane.size(), [](float v) { return std::isfinite(v); }));
      }
    }
  }
}

TEST(ReadPicture, AnAllBlackPictureIsOne) {
  const ScenePicture scene = read_good(exr_of(linear_row({{0, 0, 0}, {-0.0F, 0, 0}})));
  EXPECT_TRUE(scene.warnings.empty());
  expect_near(at(scene.xyz, 0), {0, 0, 0}, 0);
  expect_near(at(read_good(png_of(row_of<std::uint8_t>({{0, 0, 0}}))).xyz, 0), {0, 0, 0}, 0);
}

}  // namespace
}  // namespace lowlux::capture
