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
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/tiff.h"
#include "isp/model/colorimetry.h"
#include "tests/codec/pictures.h"
#include "tests/support/dng_builder.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::capture {
namespace {

using Bytes = std::vector<std::byte>;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

Result<ScenePicture> read(const Bytes& bytes, int threads = 1) {
  PoolExecutor executor(threads);
  return read_picture(bytes, "built", executor, {.max_pixels = 1 << 20});
}

ScenePicture read_good(const Bytes& bytes, int threads = 1) {
  auto scene = read(bytes, threads);
  if (scene) return *std::move(scene);
  ADD_FAILURE() << scene.error().message;
  return {SceneLinear(1, 1), false, 0, {}};
}

/// Errors are one line, name the file, and do not end with a full stop.
Error refused(const Bytes& bytes) {
  const auto scene = read(bytes);
  if (scene) {
    ADD_FAILURE() << "the file was accepted";
    return {};
  }
  const Error& error = scene.error();
  EXPECT_EQ(error.where, "built");
  EXPECT_EQ(error.message.find('\n'), std::string::npos);
  EXPECT_FALSE(error.message.empty() || error.message.back() == '.');
  return error;
}

bool has(const Error& error, const std::string& words) { return error.message.find(words) != std::string::npos; }

template <class Code>
Bytes png_of(const Encoded<Code>& picture, const isp::FileMetadata& metadata = {}) {
  InlineExecutor executor;
  return test::encoded([&](std::FILE* file) { return isp::encode_png(picture, metadata, executor, file); });
}
Bytes tiff_of(const Picture& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) { return isp::encode_tiff(picture, metadata, {}, file); });
}
Bytes exr_of(const SceneLinear& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) {
    return isp::encode_exr(picture, metadata, {isp::ExrOptions::Depth::full, {}}, file);
  });
}
Bytes pfm_of(const SceneLinear& picture) {
  return test::encoded([&](std::FILE* file) { return isp::encode_pfm(picture, file); });
}
Bytes jpeg_of(const Encoded8& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) { return isp::encode_jpeg(picture, metadata, {100, {}}, file); });
}

/// One row of pixels.
template <class Code>
Encoded<Code> row_of(const std::vector<std::array<int, 3>>& pixels) {
  Encoded<Code> picture{Plane<Code>(static_cast<int>(3 * pixels.size()), 1)};
  for (std::size_t i = 0; i < 3 * pixels.size(); ++i) picture.codes.data()[i] = static_cast<Code>(pixels[i / 3][i % 3]);
  return picture;
}
SceneLinear linear_row(const std::vector<std::array<float, 3>>& pixels) {
  SceneLinear picture(static_cast<int>(pixels.size()), 1);
  for (int x = 0; x < picture.width(); ++x) {
    for (int c = 0; c < 3; ++c) picture.plane[c].at(x, 0) = pixels[x][c];
  }
  return picture;
}

Vector3 at(const SceneLinear& xyz, int x, int y = 0) {
  return {xyz.plane[0].at(x, y), xyz.plane[1].at(x, y), xyz.plane[2].at(x, y)};
}
void expect_near(const Vector3& found, const Vector3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << i;
}

constexpr double float_tolerance = 3e-7;  // of values up to 1: planes and matrix are floats
const Vector3 d65 = isp::vector_of(*isp::xyz_of(isp::white_d65));
Vector3 grey_of(double y) { return diagonal3({y, y, y}) * d65; }
const Matrix3 rec709 = *isp::rgb_to_xyz(isp::primaries_rec709);

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
  EXPECT_TRUE(has(refused(Bytes(100)), "PNG, JPEG, TIFF, OpenEXR or PFM"));
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

Bytes exif_of(int orientation, bool big_endian) {
  const std::string head = big_endian ? std::string("MM\0\x2A\0\0\0\x08", 8) : std::string("II\x2A\0\x08\0\0\0", 8);
  Bytes bytes(reinterpret_cast<const std::byte*>(head.data()), reinterpret_cast<const std::byte*>(head.data()) + 8);
  const auto number = static_cast<double>(orientation);
  const auto rest = test::encode_directory({{274, test::Tag::numbers(test::TagType::u16, {number})}}, 8, big_endian);
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
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

struct CloseProfile {
  void operator()(cmsHPROFILE profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<std::remove_pointer_t<cmsHPROFILE>, CloseProfile>;

Bytes bytes_of(const Profile& profile) {
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile.get(), nullptr, &size);
  Bytes bytes(size);
  cmsSaveProfileToMem(profile.get(), bytes.data(), &size);
  return bytes;
}

/// Display P3's primaries with another curve for each colour.
Profile rgb_profile(const std::array<double, 3>& gamma) {
  const cmsCIExyY white{0.3127, 0.3290, 1};
  const cmsCIExyYTRIPLE primaries{{0.68, 0.32, 1}, {0.265, 0.69, 1}, {0.15, 0.06, 1}};
  std::array<cmsToneCurve*, 3> curves{};
  for (int c = 0; c < 3; ++c) curves[c] = cmsBuildGamma(nullptr, gamma[c]);
  Profile profile(cmsCreateRGBProfile(&white, &primaries, curves.data()));
  for (cmsToneCurve* curve : curves) cmsFreeToneCurve(curve);
  return profile;
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

/// 2000 pixels of 0.5 and a few bright ones: the bright end is 0.5, the bound -0.0005.
SceneLinear mostly_half(float one_value) {
  SceneLinear picture(2000, 1);
  for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size(), 0.5F);
  picture.plane[0].at(7, 0) = 1000;
  picture.plane[2].at(9, 0) = one_value;
  return picture;
}

TEST(ReadPicture, SmallNegativeValuesBecomeZeroWithAWarningThatCountsThem) {
  SceneLinear picture = mostly_half(-0.0249F);
  picture.plane[1].at(9, 0) = -1e-6F;
  const ScenePicture scene = read_good(exr_of(picture));
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_EQ(scene.warnings[0].rfind("2 slightly negative values", 0), 0u) << scene.warnings[0];
  expect_near(at(scene.xyz, 9), rec709 * Vector3{0.5, 0, 0}, float_tolerance);
}

TEST(ReadPicture, LargerNegativeValuesAreRefusedWithTheirPixel) {
  for (const float value : {-0.0251F, -1.0F}) {
    EXPECT_TRUE(has(refused(exr_of(mostly_half(value))), "blue of the pixel at column 9, row 0 is -"));
  }
  EXPECT_TRUE(has(refused(exr_of(linear_row({{-1e-6F, 0, 0}, {0, 0, 0}}))), "red"));  // nothing is bright here
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
