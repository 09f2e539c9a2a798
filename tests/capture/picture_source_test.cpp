#include "capture/file/picture_source.h"

#include <gtest/gtest.h>
#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>

#include "capture/file/picture_colour.h"
#include "isp/model/colour/colorimetry.h"
#include "tests/capture/built_pictures.h"
#include "tests/codec/pictures.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::capture {
namespace {

TEST(ReadPicture, CodesWithoutAProfileAreSrgb) {
  const std::vector<std::array<int, 3>> pixels{{0, 0, 0}, {255, 255, 255}, {10, 11, 128}, {255, 0, 0}, {188, 188, 188}};
  const auto linear = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
  for (const int step : {1, 257}) {  // 257: the same shares of 65535
    std::vector<std::array<int, 3>> codes = pixels;
    for (auto& pixel : codes) {
      for (int& code : pixel) code *= step;
    }
    const ScenePicture scene =
        read_good(step == 1 ? png_of(row_of<std::uint8_t>(codes)) : png_of(row_of<std::uint16_t>(codes)));
    for (int x = 0; x < 5; ++x) {
      const Vector3 rgb{linear(pixels[x][0] / 255.0), linear(pixels[x][1] / 255.0), linear(pixels[x][2] / 255.0)};
      expect_near(at(scene.xyz, x), rec709 * rgb, float_tolerance);
    }
    expect_near(at(scene.xyz, 1), d65, float_tolerance);
    EXPECT_NEAR(at(scene.xyz, 4)[1], 0.5029, 1e-4);  // 188/255 is half of white, in four figures
    EXPECT_FALSE(scene.absolute);
    EXPECT_EQ(scene.white_luminance_cd_m2, 0);
    EXPECT_TRUE(scene.warnings.empty());
  }
}

TEST(ReadPicture, TheFormatIsToldByTheBytes) {
  const Encoded8 grey = row_of<std::uint8_t>(std::vector<std::array<int, 3>>(8, {188, 188, 188}));
  const SceneLinear half = linear_row({{0.5F, 0.5F, 0.5F}});
  for (const Bytes& file : {png_of(grey), jpeg_of(grey), tiff_of(Encoded8{grey.codes.clone()})}) {
    expect_near(at(read_good(file).xyz, 0), grey_of(0.5029), 1e-4);
  }
  for (const Bytes& file : {tiff_of(linear_row({{0.5F, 0.5F, 0.5F}})), exr_of(half), pfm_of(half)}) {
    expect_near(at(read_good(file).xyz, 0), grey_of(0.5), float_tolerance);
  }
}

TEST(ReadPicture, FilesThatAreNoPictureAreNamed) {
  EXPECT_TRUE(has(refused({}), "empty"));
  EXPECT_TRUE(has(refused(Bytes(100)), "PNG, JPEG, TIFF, OpenEXR, PFM or PPM"));
  EXPECT_TRUE(has(refused(test::DngBuilder{}.build()), "raw file (DNG)"));
  Bytes half = png_of(test::noisy_codes<std::uint8_t>(40, 30));
  half.resize(half.size() / 2);
  EXPECT_EQ(refused(half).code, ErrorCode::malformed);
  EXPECT_EQ(refused(png_of(test::noisy_codes<std::uint8_t>(1025, 1024))).code, ErrorCode::too_large);
}

TEST(ReadPicture, PathsThatAreNoReadableFileAreOneClearLine) {
  const test::ScratchDirectory scratch;
  InlineExecutor executor;
  EXPECT_EQ(read_picture("/no/such/file.png", executor).error().code, ErrorCode::not_found);
  EXPECT_EQ(read_picture(scratch.path(), executor).error().code, ErrorCode::unreadable);
  EXPECT_EQ(read_picture(scratch.path(), executor).error().where, scratch.path());
  EXPECT_EQ(read_picture("/dev/null", executor).error().code, ErrorCode::unreadable);
  const Bytes png = png_of(row_of<std::uint8_t>({{255, 255, 255}}));
  scratch.write("misnamed.jpg", std::string(reinterpret_cast<const char*>(png.data()), png.size()));
  const auto scene = read_picture(scratch.file("misnamed.jpg"), executor);
  ASSERT_TRUE(scene) << scene.error().message;
  expect_near(at(scene->xyz, 0), d65, float_tolerance);
}

TEST(ReadPicture, TheNumberOfThreadsChangesNothing) {
  const Bytes codes = png_of(test::noisy_codes<std::uint8_t>(67, 45));
  EXPECT_TRUE(test::same_bits(read_good(codes, 1).xyz, read_good(codes, 5).xyz));
  SceneLinear picture = test::noisy_linear(67, 45);
  for (auto& plane : picture.plane)
    std::for_each(plane.data(), plane.data() + plane.size(), [](float& v) { v = v * v; });
  EXPECT_TRUE(test::same_bits(read_good(exr_of(picture), 1).xyz, read_good(exr_of(picture), 5).xyz));
}

/// A 3 x 2 picture whose red channel tells the place.
Encoded8 places() {
  Encoded8 picture{Plane<std::uint8_t>(9, 2)};
  for (int i = 0; i < 18; ++i) picture.codes.data()[i] = static_cast<std::uint8_t>(40 * (i / 3));
  return picture;
}

/// EXIF 2.32 table 6, as where a pixel of the upright picture stood in the stored one.
std::array<int, 2> stood_at(int o, int x, int y, int w, int h) {
  const std::array<std::array<int, 2>, 9> all{{{x, y},
                                               {x, y},
                                               {w - 1 - x, y},
                                               {w - 1 - x, h - 1 - y},
                                               {x, h - 1 - y},
                                               {y, x},
                                               {y, h - 1 - x},
                                               {w - 1 - y, h - 1 - x},
                                               {w - 1 - y, x}}};
  return all[o];
}

TEST(ReadPicture, EveryOrientationIsTurnedUpright) {
  const ScenePicture stored = read_good(png_of(places()));
  for (int o = 1; o <= 8; ++o) {
    isp::FileMetadata block, field;
    block.exif = exif_of(o, o % 2 == 0);
    field.info.orientation = static_cast<Orientation>(o);
    for (const Bytes& file : {png_of(places(), block), tiff_of(places(), field)}) {
      const SceneLinear upright = read_good(file).xyz;
      ASSERT_EQ(upright.width(), o < 5 ? 3 : 2) << o;
      ASSERT_EQ(upright.height(), o < 5 ? 2 : 3) << o;
      for (int y = 0; y < upright.height(); ++y) {
        for (int x = 0; x < upright.width(); ++x) {
          const auto [from_x, from_y] = stood_at(o, x, y, 3, 2);
          EXPECT_EQ(at(upright, x, y), at(stored.xyz, from_x, from_y)) << o << " at " << x << ", " << y;
        }
      }
    }
    EXPECT_EQ(read_good(jpeg_of(places(), block)).xyz.width(), o < 5 ? 3 : 2);
  }
}

TEST(ReadPicture, FloatsAreTurnedTooAndBadOrientationsAreNone) {
  isp::FileMetadata metadata;
  metadata.info.orientation = Orientation::rotate_180;
  SceneLinear picture = linear_row({{0, 0, 0}, {1, 1, 1}});
  expect_near(at(read_good(tiff_of(std::move(picture), metadata)).xyz, 0), d65, float_tolerance);
  for (const int none : {0, 9, 65535}) {
    isp::FileMetadata block;
    block.exif = exif_of(none, false);
    EXPECT_EQ(read_good(png_of(places(), block)).xyz.width(), 3);
  }
}

/// XYZ under D65 by lcms2's own transform.
Vector3 lcms_xyz(const Profile& profile, const Vector3& rgb) {
  const Profile xyz(cmsCreateXYZProfile());
  cmsHTRANSFORM transform = cmsCreateTransform(profile.get(), TYPE_RGB_DBL, xyz.get(), TYPE_XYZ_DBL,
                                               INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
  Vector3 out{};
  cmsDoTransform(transform, rgb.data(), out.data(), 1);
  cmsDeleteTransform(transform);
  const cmsCIEXYZ* d50 = cmsD50_XYZ();
  return *isp::bradford_adaptation(*isp::xy_of(isp::Xyz{d50->X, d50->Y, d50->Z}), isp::white_d65) * out;
}

TEST(ReadPicture, AnIccProfileIsHonouredAsLcmsDoes) {
  const Profile profile = rgb_profile({1.8, 2.2, 2.6});
  isp::FileMetadata metadata;
  metadata.icc = bytes_of(profile);
  const std::vector<std::array<int, 3>> pixels{{0, 0, 0}, {255, 255, 255}, {200, 30, 90}, {1, 2, 3}, {0, 255, 0}};
  const ScenePicture scene = read_good(tiff_of(row_of<std::uint8_t>(pixels), metadata));
  for (int x = 0; x < 5; ++x) {
    const Vector3 rgb{pixels[x][0] / 255.0, pixels[x][1] / 255.0, pixels[x][2] / 255.0};
    expect_near(at(scene.xyz, x), lcms_xyz(profile, rgb), 4e-5);  // two steps of the profile's 1/65536
  }
  expect_near(at(scene.xyz, 1), d65, 4e-5);
}

TEST(ReadPicture, AGreyProfileIsHonouredOnGreyOnly) {
  cmsToneCurve* curve = cmsBuildGamma(nullptr, 2.0);
  const Profile profile(cmsCreateGrayProfile(cmsD50_xyY(), curve));
  cmsFreeToneCurve(curve);
  isp::FileMetadata metadata;
  metadata.icc = bytes_of(profile);
  const ScenePicture scene = read_good(tiff_of(row_of<std::uint8_t>({{51, 51, 51}}), metadata));
  expect_near(at(scene.xyz, 0), grey_of(0.04), 2e-5);  // 0.2^2; a step of the profile's 16-bit curve
  EXPECT_TRUE(has(refused(tiff_of(row_of<std::uint8_t>({{51, 51, 51}, {51, 52, 51}}), metadata)), "grey"));
}

TEST(ReadPicture, ProfilesOfOtherKindsAndDamagedOnesAreRefused) {
  isp::FileMetadata metadata;
  metadata.icc = bytes_of(Profile(cmsCreateLab4Profile(nullptr)));
  EXPECT_EQ(refused(tiff_of(row_of<std::uint8_t>({{1, 2, 3}}), metadata)).code, ErrorCode::unsupported);
  metadata.icc.assign(200, std::byte{7});
  EXPECT_EQ(refused(tiff_of(row_of<std::uint8_t>({{1, 2, 3}}), metadata)).code, ErrorCode::malformed);
}

TEST(ReadPicture, FlippedBitsInAProfileAreAnErrorOrAFinitePicture) {
  const Bytes valid = bytes_of(rgb_profile({2.2, 2.2, 2.2}));
  std::mt19937 random(3);
  for (int round = 0; round < 3000; ++round) {
    Bytes icc = valid;
    for (int flips = 1 + round % 4; flips > 0; --flips) {
      icc[random() % icc.size()] ^= static_cast<std::byte>(1U << (random() % 8));
    }
    const auto colour = icc_colour(icc, 256);
    if (!colour) {
      EXPECT_FALSE(colour.error().message.empty());
      continue;
    }
    for (const auto& curve : colour->curve) {
      ASSERT_EQ(curve.size(), 256u);
      EXPECT_TRUE(std::all_of(curve.begin(), curve.end(), [](float v) { return v >= 0 && v <= 1; }));
    }
    for (const auto& line : colour->to_xyz) {
      EXPECT_TRUE(std::all_of(line.begin(), line.end(), [](double v) { return std::isfinite(v); }));
    }
  }
}

}  // namespace
}  // namespace lowlux::capture
