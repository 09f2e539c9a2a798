#include "isp/codec/png.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>

#include "tests/codec/pictures.h"

namespace lowlux::isp::png_test {
namespace {

using test::encoded;
using test::noisy_codes;

template <class Code>
std::vector<std::byte> png_of(const Encoded<Code>& picture, const FileMetadata& metadata = {}, int threads = 1) {
  PoolExecutor executor(threads);
  return encoded([&](std::FILE* file) { return encode_png(picture, metadata, executor, file); });
}

template <class Code>
void expect_round_trip(int width, int height) {
  const auto picture = noisy_codes<Code>(width, height);
  const auto decoded = decode_png(png_of(picture));
  ASSERT_TRUE(decoded) << decoded.error().message;
  ASSERT_TRUE(std::holds_alternative<Encoded<Code>>(decoded->picture));
  EXPECT_TRUE(test::same_bits(picture, std::get<Encoded<Code>>(decoded->picture))) << width << " x " << height;
}

TEST(Png, RoundTripIsBitExactAtAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 2}, {1, 300}, {67, 45}, {1301, 911}}) {
    expect_round_trip<std::uint8_t>(width, height);
    expect_round_trip<std::uint16_t>(width, height);
  }
}

TEST(Png, BytesDoNotDependOnTheNumberOfThreads) {
  const auto picture = noisy_codes<std::uint16_t>(1201, 1003);  // seven stretches
  const auto one = png_of(picture, {}, 1);
  EXPECT_EQ(one, png_of(picture, {}, 2));
  EXPECT_EQ(one, png_of(picture, {}, 3));
  EXPECT_EQ(one, png_of(picture, {}, 16));
}

TEST(Png, RowsLongerThanAStretchRoundTrip) { expect_round_trip<std::uint16_t>(200'000, 3); }

TEST(Png, ProfileAndExifComeBackAsTheyWere) {
  FileMetadata metadata;
  metadata.icc = test::bare_icc_profile(100);
  metadata.exif = test::bare_exif();
  const auto decoded = decode_png(png_of(noisy_codes<std::uint8_t>(5, 4), metadata));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->metadata.icc, metadata.icc);
  EXPECT_EQ(decoded->metadata.exif, metadata.exif);
}

TEST(Png, WithoutMetadataNoneComesBack) {
  const auto decoded = decode_png(png_of(noisy_codes<std::uint8_t>(5, 4)));
  ASSERT_TRUE(decoded);
  EXPECT_TRUE(decoded->metadata.icc.empty());
  EXPECT_TRUE(decoded->metadata.exif.empty());
}

TEST(Png, AFullDiskIsAnErrorThatSaysSo) {
  InlineExecutor executor;
  const auto picture = noisy_codes<std::uint8_t>(500, 500);
  test::expect_full_disks_are_reported([&](std::FILE* f) { return encode_png(picture, {}, executor, f); });
}

TEST(Png, AnEmptyPictureIsRefused) {
  InlineExecutor executor;
  EXPECT_TRUE(encoded([&](std::FILE* f) { return encode_png(Encoded8{}, {}, executor, f); }).empty());
}

// Files of the kinds lowlux does not write, put together by hand.
struct Png {
  int width, height, bits, colour;
  bool interlaced = false;
  std::vector<unsigned char> palette{};
  std::vector<unsigned char> transparency{};
  std::vector<unsigned char> rows{};  // each with its filter byte
};

void append_chunk(const char* type, std::vector<unsigned char> data, std::vector<unsigned char>& out) {
  const auto put = [&](std::uint32_t n) {
    for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<unsigned char>(n >> shift));
  };
  put(static_cast<std::uint32_t>(data.size()));
  data.insert(data.begin(), type, type + 4);
  out.insert(out.end(), data.begin(), data.end());
  put(static_cast<std::uint32_t>(crc32(0, data.data(), static_cast<uInt>(data.size()))));
}

std::vector<std::byte> bytes_of(const Png& png) {
  std::vector<unsigned char> out{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const auto byte = [](int number, int shift) { return static_cast<unsigned char>(number >> shift); };
  append_chunk("IHDR",
               {byte(png.width, 24), byte(png.width, 16), byte(png.width, 8), byte(png.width, 0), byte(png.height, 24),
                byte(png.height, 16), byte(png.height, 8), byte(png.height, 0), byte(png.bits, 0), byte(png.colour, 0),
                0, 0, png.interlaced},
               out);
  if (!png.palette.empty()) append_chunk("PLTE", png.palette, out);
  if (!png.transparency.empty()) append_chunk("tRNS", png.transparency, out);
  uLongf size = compressBound(png.rows.size());
  std::vector<unsigned char> packed(size);
  compress(packed.data(), &size, png.rows.data(), png.rows.size());
  packed.resize(size);
  append_chunk("IDAT", packed, out);
  append_chunk("IEND", {}, out);
  return test::bytes_of(out);
}

std::vector<int> codes_of(const Png& png) {
  const auto decoded = decode_png(bytes_of(png));
  if (!decoded) {
    ADD_FAILURE() << decoded.error().message;
    return {};
  }
  return std::visit(
      [](const auto& image) -> std::vector<int> {
        if constexpr (std::is_same_v<std::decay_t<decltype(image)>, SceneLinear>) {
          return {};
        } else {
          return {image.codes.data(), image.codes.data() + image.codes.size()};
        }
      },
      decoded->picture);
}

TEST(PngOfOthers, OneBitGreyBecomesBlackAndWhite) {
  EXPECT_EQ(codes_of({2, 1, 1, 0, false, {}, {}, {0, 0x40}}), (std::vector{0, 0, 0, 255, 255, 255}));
}

TEST(PngOfOthers, GreyOfSixteenBitsBecomesThreeEqualColours) {
  EXPECT_EQ(codes_of({1, 1, 16, 0, false, {}, {}, {0, 0x12, 0x34}}), (std::vector{0x1234, 0x1234, 0x1234}));
}

TEST(PngOfOthers, PaletteColoursAreLookedUpAndTheirTransparencyDropped) {
  EXPECT_EQ(codes_of({2, 1, 8, 3, false, {1, 2, 3, 40, 50, 60}, {0, 128}, {0, 1, 0}}),
            (std::vector{40, 50, 60, 1, 2, 3}));
}

TEST(PngOfOthers, AlphaIsDroppedAndColoursStayAsTheyAre) {
  EXPECT_EQ(codes_of({1, 1, 8, 6, false, {}, {}, {0, 10, 20, 30, 0}}), (std::vector{10, 20, 30}));
  EXPECT_EQ(codes_of({1, 1, 8, 4, false, {}, {}, {0, 77, 128}}), (std::vector{77, 77, 77}));
}

TEST(PngOfOthers, InterlacedRowsComeInOrder) {
  // Adam7 of 3 x 2 grey pixels 1 2 3 / 4 5 6: passes 1, 4, 6 hold one pixel each, pass 7 the second row.
  const std::vector<unsigned char> passes{0, 1, 0, 3, 0, 2, 0, 4, 5, 6};
  EXPECT_EQ(codes_of({3, 2, 8, 0, true, {}, {}, passes}),
            (std::vector{1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6}));
}

TEST(PngOfOthers, DimensionsFarBeyondTheFileSizeAreRefusedBeforeMemoryIsTaken) {
  const auto decoded = decode_png(bytes_of({16000, 16000, 8, 2, false, {}, {}, {0, 1, 2, 3}}));
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::malformed);
  EXPECT_NE(decoded.error().message.find("too short"), std::string::npos);
}

TEST(PngOfOthers, MorePixelsThanTheLimitAreTooLarge) {
  const auto decoded = decode_png(bytes_of({1'000'000, 1'000'000, 8, 2, false, {}, {}, {0, 1, 2, 3}}));
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::isp::png_test
