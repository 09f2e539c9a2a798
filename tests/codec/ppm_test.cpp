#include "isp/codec/ppm.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace lowlux::isp::ppm_test {
namespace {

Result<DecodedPicture> decoded(const std::string& text) {
  return decode_ppm(std::as_bytes(std::span(text.data(), text.size())), {.max_pixels = 1000});
}

template <class Code>
std::vector<Code> codes_of(const std::string& text, int width, int height) {
  const auto picture = decoded(text);
  if (!picture) {
    ADD_FAILURE() << picture.error().message;
    return {};
  }
  const auto& image = std::get<Encoded<Code>>(picture->picture);
  EXPECT_EQ(image.width(), width);
  EXPECT_EQ(image.height(), height);
  return {image.codes.data(), image.codes.data() + image.codes.size()};
}

TEST(Ppm, CodesOfEightAndSixteenBitsAreRead) {
  using std::string_literals::operator""s;
  using Bytes = std::vector<std::uint8_t>;
  using Words = std::vector<std::uint16_t>;
  EXPECT_EQ(codes_of<std::uint8_t>("P6\n2 1\n255\n\x01\x02\x03\xFD\xFE\xFF", 2, 1), (Bytes{1, 2, 3, 253, 254, 255}));
  EXPECT_EQ(codes_of<std::uint8_t>("P5 1 2 255\n\x07\x09", 1, 2), (Bytes{7, 7, 7, 9, 9, 9}));
  EXPECT_EQ(codes_of<std::uint16_t>("P6\n1 1\n65535\n\x01\x02\x00\x03\xFF\xFF"s, 1, 1), (Words{0x102, 3, 65535}));
}

TEST(Ppm, CommentsAndOtherMaximaAreUnderstood) {
  using std::string_literals::operator""s;
  const std::string head = "P6 # made by hand\n# twice\n 1\t1 # size\n";
  EXPECT_EQ(codes_of<std::uint8_t>(head + "15\n\x00\x05\x0F"s, 1, 1), (std::vector<std::uint8_t>{0, 85, 255}));
  EXPECT_EQ(codes_of<std::uint16_t>(head + "1023\n\x00\x00\x02\x00\x03\xFF"s, 1, 1),
            (std::vector<std::uint16_t>{0, 32800, 65535}));  // 512 / 1023 of 65535 is 32799.5
}

TEST(Ppm, WhatIsNoPpmIsRefusedWithAReason) {
  for (const auto& [text, reason] : std::vector<std::pair<std::string, std::string>>{
           {"P3\n1 1\n255\n1 2 3", "neither P5 nor P6"},
           {"P", "neither P5 nor P6"},
           {"P6\n1\n", "a width, a height and a maximum"},
           {"P6\n1 1\n255", "a width, a height and a maximum"},
           {"P6\n1 -1\n255\nabc", "a width, a height and a maximum"},
           {"P6\n99999999999 1\n255\nabc", "a width, a height and a maximum"},
           {"P6\n1 1\n0\nabc", "expected 1 to 65535"},
           {"P6\n1 1\n65536\nabcdef", "expected 1 to 65535"},
           {"P6\n0 5\n255\nabc", "no content"},
           {"P6\n1001 1\n255\nabc", "limit"},
           {"P6\n2 1\n255\nabc", "ends before its 2 x 1"},
           {"P6\n1 1\n100\nzz\xC8", "above its maximum of 100"}}) {
    const auto picture = decoded(text);
    ASSERT_FALSE(picture) << text;
    EXPECT_NE(picture.error().message.find(reason), std::string::npos) << picture.error().message;
  }
}

}  // namespace
}  // namespace lowlux::isp::ppm_test
