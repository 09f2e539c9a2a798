#include "isp/codec/pfm.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <string>

#include "tests/codec/pictures.h"

namespace lowlux::isp {
namespace {

std::vector<std::byte> pfm_of(const SceneLinear& picture) {
  return test::encoded([&](std::FILE* file) { return encode_pfm(picture, file); });
}

/// A header and floats in a stated byte order.
std::vector<std::byte> file_of(const std::string& header, const std::vector<float>& values, bool big_endian) {
  std::vector<std::byte> bytes;
  for (const char c : header) bytes.push_back(static_cast<std::byte>(c));
  for (const float value : values) {
    const auto word = std::bit_cast<std::uint32_t>(value);
    for (int i = 0; i < 4; ++i)
      bytes.push_back(static_cast<std::byte>(word >> (big_endian ? 24 - 8 * i : 8 * i) & 255));
  }
  return bytes;
}

Error refused(const std::string& header, std::size_t values = 0) {
  const auto decoded = decode_pfm(file_of(header, std::vector<float>(values), false), {.max_pixels = 1000});
  EXPECT_FALSE(decoded) << header;
  return decoded ? Error{} : decoded.error();
}

TEST(Pfm, FloatsRoundTripBitExact) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 2}, {67, 45}}) {
    SceneLinear picture = test::noisy_linear(width, height);
    picture.plane[0].at(0, 0) = std::numeric_limits<float>::quiet_NaN();
    picture.plane[1].at(0, 0) = -std::numeric_limits<float>::infinity();
    const auto decoded = decode_pfm(pfm_of(picture));
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_TRUE(test::same_bits(picture, std::get<SceneLinear>(decoded->picture)));
  }
}

TEST(Pfm, TheFileIsTheOneTheFormatDescribes) {
  SceneLinear picture(1, 2);
  for (int c = 0; c < 3; ++c) {
    picture.plane[c].at(0, 0) = static_cast<float>(c + 1);
    picture.plane[c].at(0, 1) = static_cast<float>(c + 4);
  }
  EXPECT_EQ(pfm_of(picture), file_of("PF\n1 2\n-1.0\n", {4, 5, 6, 1, 2, 3}, false));
}

TEST(Pfm, BothByteOrdersAndGreyAreRead) {
  for (const bool big_endian : {false, true}) {
    const std::string scale = big_endian ? "1.0" : "-1.0";
    const auto colour = decode_pfm(file_of("PF 1\t2\r\n" + scale + "\n", {4, 5, 6, 1, 2, 3}, big_endian));
    ASSERT_TRUE(colour) << colour.error().message;
    const auto grey = decode_pfm(file_of("Pf\n1 2\n" + scale + "\n", {0.5F, 0.25F}, big_endian));
    ASSERT_TRUE(grey) << grey.error().message;
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(std::get<SceneLinear>(colour->picture).plane[c].at(0, 0), static_cast<float>(c + 1));
      EXPECT_EQ(std::get<SceneLinear>(colour->picture).plane[c].at(0, 1), static_cast<float>(c + 4));
      EXPECT_EQ(std::get<SceneLinear>(grey->picture).plane[c].at(0, 0), 0.25F);
      EXPECT_EQ(std::get<SceneLinear>(grey->picture).plane[c].at(0, 1), 0.5F);
    }
  }
}

TEST(Pfm, OnePlaneIsWrittenAsGrey) {
  Plane<float> plane(1, 2);
  plane.at(0, 0) = 0.25F;
  plane.at(0, 1) = -0.5F;
  const Plane<float>& map = plane;
  const auto bytes = test::encoded([&](std::FILE* file) { return encode_pfm(map.view(), file); });
  EXPECT_EQ(bytes, file_of("Pf\n1 2\n-1.0\n", {-0.5F, 0.25F}, false));
}

TEST(Pfm, HeadersThatLieAreRefused) {
  EXPECT_EQ(refused("").code, ErrorCode::malformed);
  EXPECT_EQ(refused("PF").code, ErrorCode::malformed);
  EXPECT_EQ(refused("P6\n1 1\n255\n", 3).code, ErrorCode::malformed);
  EXPECT_EQ(refused("PF\n1 1\n-1.0\n", 2).code, ErrorCode::malformed);  // one sample short
  for (const char* size : {"0 1", "1 0", "-1 1", "1 -1", "1.5 1", "one 1", "1"}) {
    EXPECT_EQ(refused("PF\n" + std::string(size) + "\n-1.0\n", 3).code, ErrorCode::malformed) << size;
  }
  EXPECT_EQ(refused("PF\n" + std::string(1000, '1') + " 1\n-1.0\n", 3).code, ErrorCode::malformed);
  EXPECT_EQ(refused("PF\n2000000000 2000000000\n-1.0\n", 3).code, ErrorCode::too_large);
  EXPECT_EQ(refused("PF\n9000000000000000000 9\n-1.0\n", 3).code, ErrorCode::too_large);
  EXPECT_EQ(refused("PF\n1001 1\n-1.0\n", 3003).code, ErrorCode::too_large);
}

TEST(Pfm, ScalesThatWritersDisagreeOnAreRefused) {
  for (const char* scale : {"0", "-0.5", "255", "inf", "nan"}) {
    const Error error = refused("PF\n1 1\n" + std::string(scale) + "\n", 3);
    EXPECT_EQ(error.code, ErrorCode::unsupported) << scale;
    EXPECT_NE(error.message.find("scale"), std::string::npos);
  }
}

TEST(Pfm, AFullDiskIsAnErrorThatSaysSo) {
  const SceneLinear picture = test::noisy_linear(60, 41);
  test::expect_full_disks_are_reported([&](std::FILE* file) { return encode_pfm(picture, file); });
}

TEST(Pfm, APictureWithoutPixelsIsNotWritten) { EXPECT_TRUE(pfm_of(SceneLinear(0, 0)).empty()); }

}  // namespace
}  // namespace lowlux::isp
