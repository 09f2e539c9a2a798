#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>

#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/ppm.h"
#include "isp/codec/tiff.h"
#include "tests/codec/pictures.h"

namespace lowlux::isp {
namespace {

using Bytes = std::vector<std::byte>;
constexpr DecodeLimits small{1 << 20};

struct Format {
  const char* name;
  Result<DecodedPicture> (*decode)(std::span<const std::byte>, const DecodeLimits&);
  Bytes valid;
};

FileMetadata some_metadata() {
  FileMetadata metadata;
  metadata.icc = test::bare_icc_profile(100);
  metadata.exif = test::bare_exif();
  metadata.info.make = "Maker";
  metadata.info.exposure_s = 0.1;
  metadata.info.iso = 100000;
  metadata.chromaticities = Chromaticities{{0.6, 0.3}, {0.3, 0.6}, {0.1, 0.1}, {0.3, 0.3}};
  return metadata;
}

Bytes deep_ppm() {
  Bytes out;
  for (const char c : std::string("P6 # 16 bits\n40 30\n65535\n")) out.push_back(static_cast<std::byte>(c));
  const auto codes = test::noisy_codes<std::uint16_t>(40, 30);
  for (std::size_t i = 0; i < codes.codes.size(); ++i) {
    out.push_back(static_cast<std::byte>(codes.codes.data()[i] >> 8));
    out.push_back(static_cast<std::byte>(codes.codes.data()[i] & 255));
  }
  return out;
}

std::vector<Format> formats() {
  static InlineExecutor executor;
  const auto codes = test::noisy_codes<std::uint8_t>(40, 30);
  const auto linear = test::noisy_linear(40, 30);
  const FileMetadata metadata = some_metadata();
  const Picture deep = test::noisy_codes<std::uint16_t>(40, 30);
  const Picture floats = test::noisy_linear(40, 30);
  const auto bytes = [](const auto& encode) { return test::encoded(encode); };
  return {
      {"png", decode_png, bytes([&](std::FILE* f) { return encode_png(codes, metadata, executor, f); })},
      {"jpeg", decode_jpeg, bytes([&](std::FILE* f) { return encode_jpeg(codes, metadata, {}, f); })},
      {"tiff16", decode_tiff,
       bytes([&](std::FILE* f) { return encode_tiff(deep, metadata, {TiffOptions::Compression::deflate}, f); })},
      {"tifff", decode_tiff,
       bytes([&](std::FILE* f) { return encode_tiff(floats, metadata, {TiffOptions::Compression::none}, f); })},
      {"ppm", decode_ppm, deep_ppm()},
      {"pfm", decode_pfm, bytes([&](std::FILE* f) { return encode_pfm(linear, f); })},
      {"piz", decode_exr, bytes([&](std::FILE* f) {
         return encode_exr(linear, metadata, {ExrOptions::Depth::half, ExrOptions::Compression::piz}, f);
       })},
      {"exr", decode_exr, bytes([&](std::FILE* f) { return encode_exr(linear, metadata, {}, f); })},
  };
}

/// Either an error with a message, or a picture inside the limits.
void expect_sane(const Result<DecodedPicture>& decoded, const std::string& what) {
  if (!decoded) {
    EXPECT_FALSE(decoded.error().message.empty()) << what;
    EXPECT_EQ(decoded.error().message.find('\n'), std::string::npos) << what << ": " << decoded.error().message;
    return;
  }
  std::visit(
      [&](const auto& image) {
        EXPECT_GE(image.width(), 1) << what;
        EXPECT_GE(image.height(), 1) << what;
        EXPECT_LE(std::int64_t{image.width()} * image.height(), small.max_pixels) << what;
      },
      decoded->picture);
}

TEST(HostileBytes, EveryTruncationIsAnErrorOrAPicture) {
  for (const Format& format : formats()) {
    ASSERT_FALSE(format.valid.empty()) << format.name;
    ASSERT_TRUE(format.decode(format.valid, small)) << format.name;
    for (std::size_t size = 0; size < format.valid.size(); size += size < 600 ? 1 : 37) {
      const std::span<const std::byte> head(format.valid.data(), size);
      expect_sane(format.decode(head, small), format.name + std::string(" cut to ") + std::to_string(size));
    }
  }
}

TEST(HostileBytes, HalfAFileIsNeverAPicture) {
  for (const Format& format : formats()) {
    const std::span<const std::byte> half(format.valid.data(), format.valid.size() / 2);
    EXPECT_FALSE(format.decode(half, small)) << format.name;
  }
}

TEST(HostileBytes, FlippedBitsAreAnErrorOrAPicture) {
  std::mt19937 random(20240607);
  for (const Format& format : formats()) {
    for (int round = 0; round < 2000; ++round) {
      Bytes bytes = format.valid;
      // Half of the rounds strike the first 400 bytes, where the headers are.
      const std::size_t reach = round % 2 == 0 ? std::min<std::size_t>(400, bytes.size()) : bytes.size();
      for (int flips = 1 + round % 5; flips > 0; --flips) {
        bytes[random() % reach] ^= static_cast<std::byte>(1U << (random() % 8));
      }
      expect_sane(format.decode(bytes, small), format.name + std::string(" round ") + std::to_string(round));
    }
  }
}

TEST(HostileBytes, FlippedBitsAtTheEndOfAFileAreAnErrorOrAPicture) {
  std::mt19937 random(7);
  for (const Format& format : formats()) {
    for (int round = 0; round < 1000; ++round) {
      Bytes bytes = format.valid;  // TIFF keeps its directories there
      for (int flips = 1 + round % 3; flips > 0; --flips) {
        bytes[bytes.size() - 1 - random() % 300] ^= static_cast<std::byte>(1U << (random() % 8));
      }
      expect_sane(format.decode(bytes, small), format.name + std::string(" round ") + std::to_string(round));
    }
  }
}

TEST(HostileBytes, NoBytesTextAndZeroesAreErrors) {
  const std::string text = "This is a text file and not a picture at all, whatever its name may say.";
  const auto words = std::as_bytes(std::span(text));
  const Bytes zeroes(5000);
  for (const Format& format : formats()) {
    EXPECT_FALSE(format.decode({}, small)) << format.name;
    EXPECT_FALSE(format.decode(words, small)) << format.name;
    EXPECT_FALSE(format.decode(zeroes, small)) << format.name;
  }
}

TEST(HostileBytes, AFileOfAnotherFormatIsAnError) {
  const auto all = formats();
  for (const Format& reader : all) {
    for (const Format& file : all) {
      if (reader.decode == file.decode) continue;
      EXPECT_FALSE(reader.decode(file.valid, small)) << reader.name << file.name;
    }
  }
}

TEST(HostileBytes, WhatALibrarySaysOfThemIsOneLine) {
  EXPECT_EQ(not_readable("picture", "no channel 'a\nb\x7f\x01' is 4 \xC2\xB5m wide").value().message,
            "not a readable picture: no channel 'a b  ' is 4 \xC2\xB5m wide");
  EXPECT_EQ(not_readable("picture", "").value().code, ErrorCode::malformed);
}

std::vector<std::byte> exr_header(const std::string& attributes, char flags = 0) {
  const std::string all = std::string("\x76\x2F\x31\x01\x02", 5) + flags + std::string(2, '\0') + attributes;
  const auto bytes = std::as_bytes(std::span(all));
  return {bytes.begin(), bytes.end()};
}

TEST(ExrHeader, AttributesMustEndWithinTheFile) {
  const auto attribute = [](const std::string& type, const std::string& size, const std::string& value) {
    return "a" + std::string(1, '\0') + type + std::string(1, '\0') + size + value;
  };
  const std::string end(1, '\0'), four("\x04\0\0\0", 4), twelve("\x0C\0\0\0", 4);
  EXPECT_TRUE(check_exr_header(exr_header(end)));
  EXPECT_TRUE(check_exr_header(exr_header(attribute("string", four, "text") + end)));
  EXPECT_FALSE(check_exr_header(exr_header(attribute("string", four, "text"))));  // no end of the header
  EXPECT_FALSE(check_exr_header(exr_header(attribute("string", four, "tex"))));
  EXPECT_FALSE(check_exr_header(exr_header(attribute("string", "\xFF\xFF\xFF\x7F", "text") + end)));
  const std::string one("\x01\0\0\0", 4), many("\xFF\xFF\0\0", 4);
  EXPECT_TRUE(check_exr_header(exr_header(attribute("preview", twelve, one + one + "RGBA") + end)));
  EXPECT_FALSE(check_exr_header(exr_header(attribute("preview", twelve, many + many + "RGBA") + end)));
  EXPECT_FALSE(check_exr_header(exr_header(attribute("preview", four, one) + end)));
  EXPECT_TRUE(
      check_exr_header(exr_header(attribute("stringvector", twelve, four + "text" + end + end + end + end) + end)));
  EXPECT_FALSE(check_exr_header(exr_header(attribute("stringvector", twelve, many + "texttext") + end)));
}

// OpenEXR reads as many bytes of a value as its type has, and of a channel list up to its end: where the stated size is
// another, what follows would be read as attributes that were never checked.
TEST(ExrHeader, SizesMustBeThoseThatOpenExrReads) {
  const auto header = [](const std::string& type, const std::string& value) {
    const std::string size = {static_cast<char>(value.size()), 0, 0, 0};
    return exr_header("a" + std::string(1, '\0') + type + std::string(1, '\0') + size + value + std::string(1, '\0'));
  };
  const auto zeros = [](std::size_t count) { return std::string(count, '\0'); };
  const std::string channel = "R" + zeros(1) + zeros(16);
  for (const auto& [type, bytes] : {std::pair{"float", 4},
                                    {"v2f", 8},
                                    {"box2i", 16},
                                    {"chromaticities", 32},
                                    {"compression", 1},
                                    {"tiledesc", 9},
                                    {"keycode", 28},
                                    {"m33f", 36}}) {
    EXPECT_TRUE(check_exr_header(header(type, zeros(static_cast<std::size_t>(bytes))))) << type;
    EXPECT_FALSE(check_exr_header(header(type, zeros(static_cast<std::size_t>(bytes) + 1)))) << type;
    EXPECT_FALSE(check_exr_header(header(type, zeros(static_cast<std::size_t>(bytes) - 1)))) << type;
  }
  EXPECT_TRUE(check_exr_header(header("chlist", channel + channel + zeros(1))));
  EXPECT_FALSE(check_exr_header(header("chlist", channel + channel)));
  EXPECT_FALSE(check_exr_header(header("chlist", channel + zeros(1) + channel)));
  EXPECT_FALSE(check_exr_header(header("chlist", zeros(0))));
  EXPECT_FALSE(check_exr_header(header("floatvector", zeros(7))));
  EXPECT_TRUE(check_exr_header(header("floatvector", zeros(8))));
}

TEST(ExrHeader, DeepFilesAndThoseOfSeveralPartsAreRefusedByName) {
  for (const char flags : {'\x08', '\x10'}) {
    const auto checked = check_exr_header(exr_header(std::string(1, '\0'), flags));
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::unsupported);
  }
}

/// The OpenEXR data window is four little-endian numbers after its attribute's head.
TEST(HostileBytes, AnExrWindowOfManyPixelsIsRefusedBeforeMemoryIsTaken) {
  Bytes bytes = formats().back().valid;
  const std::string head("dataWindow\0box2i\0\x10\0\0\0", 21);
  const auto place = std::search(bytes.begin(), bytes.end(), head.begin(), head.end(),
                                 [](std::byte b, char c) { return b == static_cast<std::byte>(c); });
  ASSERT_NE(place, bytes.end());
  for (const auto& [low, high] : {std::pair{0x00, 0x7F}, {0x80, 0x7F}, {0x7F, 0x80}}) {
    Bytes patched = bytes;
    const auto window = patched.begin() + (place - bytes.begin()) + static_cast<std::ptrdiff_t>(head.size());
    std::fill(window, window + 8, static_cast<std::byte>(low));
    std::fill(window + 8, window + 16, static_cast<std::byte>(high));
    EXPECT_FALSE(decode_exr(patched)) << low << " to " << high;
  }
}

}  // namespace
}  // namespace lowlux::isp
