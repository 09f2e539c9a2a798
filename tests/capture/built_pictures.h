#pragma once

#include <gtest/gtest.h>
#include <lcms2.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "capture/file/picture_source.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/tiff.h"
#include "isp/model/colour/colorimetry.h"
#include "tests/codec/pictures.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/error_words.h"

/// Picture files of every format in memory, and what read_picture makes of them.
namespace lowlux::capture {

using test::has;

using Bytes = std::vector<std::byte>;
inline constexpr float nan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float infinity = std::numeric_limits<float>::infinity();

inline Result<ScenePicture> read(const Bytes& bytes, int threads = 1) {
  PoolExecutor executor(threads);
  return read_picture(bytes, "built", executor, {.max_pixels = 1 << 20});
}

inline ScenePicture read_good(const Bytes& bytes, int threads = 1) {
  auto scene = read(bytes, threads);
  if (scene) return *std::move(scene);
  ADD_FAILURE() << scene.error().message;
  return {SceneLinear(1, 1), false, 0, {}};
}

/// Errors are one line, name the file, and do not end with a full stop.
inline Error refused(const Bytes& bytes) {
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

template <class Code>
Bytes png_of(const Encoded<Code>& picture, const isp::FileMetadata& metadata = {}) {
  InlineExecutor executor;
  return test::encoded([&](std::FILE* file) { return isp::encode_png(picture, metadata, executor, file); });
}
inline Bytes tiff_of(const Picture& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) { return isp::encode_tiff(picture, metadata, {}, file); });
}
inline Bytes exr_of(const SceneLinear& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) {
    return isp::encode_exr(picture, metadata, {isp::ExrOptions::Depth::full, {}}, file);
  });
}
inline Bytes pfm_of(const SceneLinear& picture) {
  return test::encoded([&](std::FILE* file) { return isp::encode_pfm(picture, file); });
}
inline Bytes jpeg_of(const Encoded8& picture, const isp::FileMetadata& metadata = {}) {
  return test::encoded([&](std::FILE* file) { return isp::encode_jpeg(picture, metadata, {100, {}}, file); });
}

/// One row of pixels.
template <class Code>
Encoded<Code> row_of(const std::vector<std::array<int, 3>>& pixels) {
  Encoded<Code> picture{Plane<Code>(static_cast<int>(3 * pixels.size()), 1)};
  for (std::size_t i = 0; i < 3 * pixels.size(); ++i) picture.codes.data()[i] = static_cast<Code>(pixels[i / 3][i % 3]);
  return picture;
}
inline SceneLinear linear_row(const std::vector<std::array<float, 3>>& pixels) {
  SceneLinear picture(static_cast<int>(pixels.size()), 1);
  for (int x = 0; x < picture.width(); ++x) {
    for (int c = 0; c < 3; ++c) picture.plane[c].at(x, 0) = pixels[x][c];
  }
  return picture;
}

inline Vector3 at(const SceneLinear& xyz, int x, int y = 0) {
  return {xyz.plane[0].at(x, y), xyz.plane[1].at(x, y), xyz.plane[2].at(x, y)};
}
inline void expect_near(const Vector3& found, const Vector3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << i;
}

inline constexpr double float_tolerance = 3e-7;  // of values up to 1: planes and matrix are floats
inline const Vector3 d65 = isp::vector_of(*isp::xyz_of(isp::white_d65));
inline Vector3 grey_of(double y) { return diagonal3({y, y, y}) * d65; }
inline const Matrix3 rec709 = *isp::rgb_to_xyz(isp::primaries_rec709);

inline Bytes exif_of(int orientation, bool big_endian) {
  const std::string head = big_endian ? std::string("MM\0\x2A\0\0\0\x08", 8) : std::string("II\x2A\0\x08\0\0\0", 8);
  Bytes bytes(reinterpret_cast<const std::byte*>(head.data()), reinterpret_cast<const std::byte*>(head.data()) + 8);
  const auto number = static_cast<double>(orientation);
  const auto rest = test::encode_directory({{274, test::Tag::numbers(test::TagType::u16, {number})}}, 8, big_endian);
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
}

struct CloseProfile {
  void operator()(cmsHPROFILE profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<std::remove_pointer_t<cmsHPROFILE>, CloseProfile>;

inline Bytes bytes_of(const Profile& profile) {
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile.get(), nullptr, &size);
  Bytes bytes(size);
  cmsSaveProfileToMem(profile.get(), bytes.data(), &size);
  return bytes;
}

/// Display P3's primaries with another curve for each colour.
inline Profile rgb_profile(const std::array<double, 3>& gamma) {
  const cmsCIExyY white{0.3127, 0.3290, 1};
  const cmsCIExyYTRIPLE primaries{{0.68, 0.32, 1}, {0.265, 0.69, 1}, {0.15, 0.06, 1}};
  std::array<cmsToneCurve*, 3> curves{};
  for (int c = 0; c < 3; ++c) curves[c] = cmsBuildGamma(nullptr, gamma[c]);
  Profile profile(cmsCreateRGBProfile(&white, &primaries, curves.data()));
  for (cmsToneCurve* curve : curves) cmsFreeToneCurve(curve);
  return profile;
}

}  // namespace lowlux::capture
