#include "isp/codec/jpeg.h"

#include <gtest/gtest.h>
// jpeglib.h needs FILE and size_t declared before it.
#include <jpeglib.h>

#include <string>

#include "tests/codec/pictures.h"

namespace lowlux::isp {
namespace {

using test::encoded;
using test::noisy_codes;

std::vector<std::byte> jpeg_of(const Encoded8& picture, const FileMetadata& metadata = {},
                               const JpegOptions& options = {}) {
  return encoded([&](std::FILE* file) { return encode_jpeg(picture, metadata, options, file); });
}

double quality_db(const Encoded8& picture, const JpegOptions& options) {
  const auto decoded = decode_jpeg(jpeg_of(picture, {}, options));
  return decoded ? test::psnr_db(picture, std::get<Encoded8>(decoded->picture)) : 0.0;
}

TEST(Jpeg, DefaultQualityStaysAbove40dB) {
  EXPECT_GT(quality_db(noisy_codes<std::uint8_t>(160, 120), {}), 40.0);
  EXPECT_GT(quality_db(noisy_codes<std::uint8_t>(33, 17), {}), 40.0);  // partial blocks
}

TEST(Jpeg, HigherQualityIsCloserToThePicture) {
  const auto picture = noisy_codes<std::uint8_t>(160, 120);
  const double low = quality_db(picture, {.quality = 50});
  const double middle = quality_db(picture, {});
  const double high = quality_db(picture, {.quality = 100});
  EXPECT_LT(low, middle);
  EXPECT_LT(middle, high);
}

TEST(Jpeg, FullChromaKeepsColourEdgesThatHalfChromaBlurs) {
  Encoded8 stripes{Plane<std::uint8_t>(3 * 64, 64)};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c)
        stripes.codes.at(3 * x + c, y) = x % 2 == 0 ? (c == 0 ? 200 : 40) : (c == 2 ? 200 : 40);
    }
  }
  const double full = quality_db(stripes, {});
  const double half = quality_db(stripes, {.chroma = JpegOptions::Chroma::half});
  EXPECT_GT(full, half + 10);
}

TEST(Jpeg, ALongProfileIsSplitAndJoinedAgain) {
  FileMetadata metadata;
  metadata.icc = test::bare_icc_profile(150'000);  // three segments
  metadata.exif = test::bare_exif();
  const auto decoded = decode_jpeg(jpeg_of(noisy_codes<std::uint8_t>(16, 16), metadata));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->metadata.icc, metadata.icc);
  EXPECT_EQ(decoded->metadata.exif, metadata.exif);
}

TEST(Jpeg, OptionsAndSizesTheFormatCannotHoldAreRefused) {
  EXPECT_TRUE(jpeg_of(noisy_codes<std::uint8_t>(8, 8), {}, {.quality = 0}).empty());
  EXPECT_TRUE(jpeg_of(noisy_codes<std::uint8_t>(8, 8), {}, {.quality = 101}).empty());
  EXPECT_TRUE(jpeg_of(noisy_codes<std::uint8_t>(65501, 1)).empty());
  EXPECT_FALSE(jpeg_of(noisy_codes<std::uint8_t>(65500, 1)).empty());
  FileMetadata metadata;
  metadata.exif.resize(65528);
  EXPECT_TRUE(jpeg_of(noisy_codes<std::uint8_t>(8, 8), metadata).empty());
  metadata.exif.resize(65527);
  EXPECT_FALSE(jpeg_of(noisy_codes<std::uint8_t>(8, 8), metadata).empty());
}

TEST(Jpeg, AFullDiskIsAnErrorThatSaysSo) {
  const auto picture = noisy_codes<std::uint8_t>(500, 500);
  test::expect_full_disks_are_reported([&](std::FILE* f) { return encode_jpeg(picture, {}, {}, f); });
}

TEST(Jpeg, AFileThatEndsEarlyIsAnErrorAndNotAPictureFilledWithGrey) {
  auto bytes = jpeg_of(noisy_codes<std::uint8_t>(64, 64));
  bytes.resize(bytes.size() * 9 / 10);
  const auto decoded = decode_jpeg(bytes);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::malformed);
}

TEST(Jpeg, MorePixelsThanTheLimitAreTooLarge) {
  const auto decoded = decode_jpeg(jpeg_of(noisy_codes<std::uint8_t>(64, 64)), {.max_pixels = 4095});
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::too_large);
  EXPECT_TRUE(decode_jpeg(jpeg_of(noisy_codes<std::uint8_t>(64, 64)), {.max_pixels = 4096}));
}

/// 8 x 8 pixels of one code in a colour space lowlux does not write.
std::vector<std::byte> flat_jpeg(J_COLOR_SPACE space, int components, unsigned char code, bool progressive) {
  return encoded([&](std::FILE* file) -> Result<void> {
    jpeg_error_mgr errors;
    jpeg_compress_struct jpeg{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = jpeg.image_height = 8;
    jpeg.input_components = components;
    jpeg.in_color_space = space;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    if (progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<unsigned char> row(std::size_t{8} * components, code);
    JSAMPROW rows = row.data();
    for (int y = 0; y < 8; ++y) jpeg_write_scanlines(&jpeg, &rows, 1);
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return {};
  });
}

TEST(JpegOfOthers, GreyBecomesThreeEqualColours) {
  const auto decoded = decode_jpeg(flat_jpeg(JCS_GRAYSCALE, 1, 77, false));
  ASSERT_TRUE(decoded) << decoded.error().message;
  const auto& codes = std::get<Encoded8>(decoded->picture).codes;
  ASSERT_EQ(codes.size(), 3U * 8 * 8);
  for (std::size_t i = 0; i < codes.size(); ++i) EXPECT_EQ(codes.data()[i], 77);
}

TEST(JpegOfOthers, ProgressiveFilesAreRead) {
  const auto decoded = decode_jpeg(flat_jpeg(JCS_RGB, 3, 50, true));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_NEAR(std::get<Encoded8>(decoded->picture).codes.at(0, 0), 50, 1);
}

TEST(JpegOfOthers, CmykIsRefusedByName) {
  const auto decoded = decode_jpeg(flat_jpeg(JCS_CMYK, 4, 50, false));
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::unsupported);
  EXPECT_NE(decoded.error().message.find("CMYK"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::isp
