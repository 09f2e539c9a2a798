#include "isp/codec/tiff.h"

#include <gtest/gtest.h>
#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>

#include "tests/codec/pictures.h"

namespace lowlux::isp::tiff_test {
namespace {

using test::encoded;
using test::noisy_codes;
using test::noisy_linear;
using Compression = TiffOptions::Compression;

std::vector<std::byte> tiff_of(const Picture& picture, const FileMetadata& metadata = {},
                               const TiffOptions& options = {}) {
  return encoded([&](std::FILE* file) { return encode_tiff(picture, metadata, options, file); });
}

template <class Image>
void expect_round_trip(Image image, Compression compression) {
  const Picture picture(std::move(image));
  const auto decoded = decode_tiff(tiff_of(picture, {}, {compression}));
  ASSERT_TRUE(decoded) << decoded.error().message;
  ASSERT_TRUE(std::holds_alternative<Image>(decoded->picture));
  EXPECT_TRUE(test::same_bits(std::get<Image>(picture), std::get<Image>(decoded->picture)));
}

TEST(Tiff, RoundTripIsBitExactForEverySampleTypeAndCompression) {
  for (const Compression compression : {Compression::none, Compression::deflate}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 2}, {67, 45}, {611, 901}}) {
      expect_round_trip(noisy_codes<std::uint8_t>(width, height), compression);
      expect_round_trip(noisy_codes<std::uint16_t>(width, height), compression);
      expect_round_trip(noisy_linear(width, height), compression);
    }
  }
}

TEST(Tiff, FloatsThatAreNoOrdinaryNumbersComeBackAsTheyWere) {
  SceneLinear picture = noisy_linear(4, 1);
  picture.plane[0].at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  picture.plane[1].at(1, 0) = -std::numeric_limits<float>::infinity();
  picture.plane[2].at(2, 0) = std::numeric_limits<float>::denorm_min();
  picture.plane[0].at(3, 0) = -0.0f;
  expect_round_trip(std::move(picture), Compression::deflate);
}

FrameInfo camera_info() {
  FrameInfo info;
  info.make = "Maker";
  info.model = "Model 1";
  info.software = "lowlux 1";
  info.date_time = "2024:02:03 04:05:06";
  info.exposure_s = 1.0 / 30;
  info.iso = 3200;
  info.f_number = 1.8;
  info.focal_length_mm = 35;
  info.temperature_c = -12.5;
  info.orientation = Orientation::rotate_90;
  return info;
}

TEST(Tiff, ProfileAndExposureComeBack) {
  FileMetadata metadata;
  metadata.icc = test::bare_icc_profile(100);
  metadata.info = camera_info();
  const auto decoded = decode_tiff(tiff_of(noisy_codes<std::uint16_t>(7, 5), metadata));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->metadata.icc, metadata.icc);
  const FrameInfo& info = decoded->metadata.info;
  EXPECT_EQ(info.make, "Maker");
  EXPECT_EQ(info.model, "Model 1");
  EXPECT_EQ(info.software, "lowlux 1");
  EXPECT_EQ(info.date_time, "2024:02:03 04:05:06");
  EXPECT_EQ(info.orientation, Orientation::rotate_90);
  EXPECT_EQ(info.temperature_c, -12.5);
  EXPECT_NEAR(info.exposure_s.value_or(0), 1.0 / 30, 1e-8);  // float in libtiff's interface
  EXPECT_NEAR(info.f_number.value_or(0), 1.8, 1e-6);
  EXPECT_EQ(info.iso, 3200);
  EXPECT_EQ(info.focal_length_mm, 35);
}

TEST(Tiff, SensitivitiesAbove65535ComeBackExactly) {
  for (const double iso : {65534.0, 65535.0, 409600.0}) {
    FileMetadata metadata;
    metadata.info.iso = iso;
    const auto decoded = decode_tiff(tiff_of(noisy_codes<std::uint8_t>(7, 5), metadata));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->metadata.info.iso, iso);
  }
}

TEST(Tiff, WhatIsUnknownStaysAbsent) {
  const auto decoded = decode_tiff(tiff_of(noisy_codes<std::uint8_t>(7, 5)));
  ASSERT_TRUE(decoded);
  const FrameInfo& info = decoded->metadata.info;
  EXPECT_TRUE(info.make.empty() && info.model.empty() && info.software.empty() && info.date_time.empty());
  EXPECT_FALSE(info.exposure_s || info.f_number || info.iso || info.focal_length_mm);
  EXPECT_TRUE(decoded->metadata.icc.empty());
}

TEST(Tiff, AFullDiskIsAnErrorThatSaysSo) {
  const Picture picture = noisy_codes<std::uint16_t>(700, 500);
  for (const Compression compression : {Compression::none, Compression::deflate}) {
    test::expect_full_disks_are_reported([&](std::FILE* f) { return encode_tiff(picture, {}, {compression}, f); });
  }
}

// Files of the kinds lowlux does not write, made by libtiff itself.
struct Kind {
  int bits = 8;
  int samples = 1;
  int photometric = PHOTOMETRIC_MINISBLACK;
  int format = SAMPLEFORMAT_UINT;
  int planar = PLANARCONFIG_CONTIG;
  bool tiled = false;
};

/// `bytes` are the samples row by row (plane by plane if separate), or one 16 x 16 tile.
std::vector<std::byte> tiff_of_kind(const Kind& kind, int width, int height, std::vector<unsigned char> bytes) {
  std::string name = testing::TempDir() + "lowlux_tiff_XXXXXX";
  const int descriptor = mkstemp(name.data());
  std::FILE* file = fdopen(dup(descriptor), "rb");
  TIFF* tiff = TIFFFdOpen(descriptor, name.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.format);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planar);
  if (kind.tiled) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
    TIFFWriteEncodedTile(tiff, 0, bytes.data(), static_cast<tmsize_t>(bytes.size()));
  } else {
    const int planes = kind.planar == PLANARCONFIG_SEPARATE ? kind.samples : 1;
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, height);
    const std::size_t size = bytes.size() / planes;
    for (int i = 0; i < planes; ++i) {
      TIFFWriteEncodedStrip(tiff, i, bytes.data() + i * size, static_cast<tmsize_t>(size));
    }
  }
  TIFFClose(tiff);
  auto contents = test::contents(file);
  std::fclose(file);
  unlink(name.c_str());
  return contents;
}

std::vector<int> codes_of(const std::vector<std::byte>& bytes) {
  const auto decoded = decode_tiff(bytes);
  if (!decoded) {
    ADD_FAILURE() << decoded.error().message;
    return {};
  }
  if (const auto* image = std::get_if<Encoded16>(&decoded->picture)) {
    return {image->codes.data(), image->codes.data() + image->codes.size()};
  }
  const auto& codes = std::get<Encoded8>(decoded->picture).codes;
  return {codes.data(), codes.data() + codes.size()};
}

TEST(TiffOfOthers, GreyBecomesThreeEqualColours) {
  EXPECT_EQ(codes_of(tiff_of_kind({}, 2, 1, {5, 9})), (std::vector{5, 5, 5, 9, 9, 9}));
  EXPECT_EQ(codes_of(tiff_of_kind({.bits = 16}, 1, 1, {0x34, 0x12})), (std::vector(3, 0x1234)));
}

TEST(TiffOfOthers, WhereZeroIsWhiteCodesAreInverted) {
  EXPECT_EQ(codes_of(tiff_of_kind({.photometric = PHOTOMETRIC_MINISWHITE}, 2, 1, {0, 55})),
            (std::vector{255, 255, 255, 200, 200, 200}));
}

TEST(TiffOfOthers, SamplesBeyondTheColoursAreDropped) {
  EXPECT_EQ(codes_of(tiff_of_kind({.samples = 4, .photometric = PHOTOMETRIC_RGB}, 2, 1, {1, 2, 3, 99, 4, 5, 6, 99})),
            (std::vector{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(codes_of(tiff_of_kind({.samples = 2}, 2, 1, {7, 99, 8, 99})), (std::vector{7, 7, 7, 8, 8, 8}));
}

TEST(TiffOfOthers, SeparatePlanesAreInterleaved) {
  const Kind rgb{.samples = 3, .photometric = PHOTOMETRIC_RGB, .planar = PLANARCONFIG_SEPARATE};
  EXPECT_EQ(codes_of(tiff_of_kind(rgb, 2, 1, {1, 2, 11, 12, 21, 22})), (std::vector{1, 11, 21, 2, 12, 22}));
  const Kind grey_alpha{.samples = 2, .planar = PLANARCONFIG_SEPARATE};
  EXPECT_EQ(codes_of(tiff_of_kind(grey_alpha, 2, 1, {7, 8, 99, 99})), (std::vector{7, 7, 7, 8, 8, 8}));
}

TEST(TiffOfOthers, TilesAreCutToThePicture) {
  std::vector<unsigned char> tile(256);
  for (int i = 0; i < 256; ++i) tile[i] = static_cast<unsigned char>(i);
  EXPECT_EQ(codes_of(tiff_of_kind({.tiled = true}, 2, 2, tile)),
            (std::vector{0, 0, 0, 1, 1, 1, 16, 16, 16, 17, 17, 17}));
}

TEST(TiffOfOthers, OtherKindsAreRefusedByName) {
  const auto refusal = [](const Kind& kind, const std::vector<unsigned char>& bytes) {
    const auto decoded = decode_tiff(tiff_of_kind(kind, 1, 1, bytes));
    return decoded ? std::string("decoded") : decoded.error().message;
  };
  EXPECT_NE(refusal({.bits = 32}, {1, 2, 3, 4}).find("32-bit samples of format 1"), std::string::npos);
  EXPECT_NE(refusal({.bits = 8, .format = SAMPLEFORMAT_INT}, {1}).find("format 2"), std::string::npos);
  EXPECT_NE(refusal({.samples = 4, .photometric = PHOTOMETRIC_SEPARATED}, {1, 2, 3, 4}).find("interpretation 5"),
            std::string::npos);
  EXPECT_NE(refusal({.samples = 1, .photometric = PHOTOMETRIC_RGB}, {1}).find("1 samples"), std::string::npos);
}

TEST(TiffOfOthers, MorePixelsThanTheLimitAreTooLarge) {
  const auto bytes = tiff_of(noisy_codes<std::uint8_t>(20, 10));
  EXPECT_TRUE(decode_tiff(bytes, {.max_pixels = 200}));
  const auto decoded = decode_tiff(bytes, {.max_pixels = 199});
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::isp::tiff_test
