#include "isp/codec/exr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/codec/pictures.h"

namespace lowlux::isp {
namespace {

using test::encoded;
using test::noisy_linear;
using Depth = ExrOptions::Depth;

using Compression = ExrOptions::Compression;

std::vector<std::byte> exr_of(const SceneLinear& picture, Depth depth, const FileMetadata& metadata = {},
                              Compression compression = Compression::none) {
  return encoded([&](std::FILE* file) { return encode_exr(picture, metadata, {depth, compression}, file); });
}

TEST(Exr, FloatsRoundTripBitExact) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 2}, {67, 45}, {300, 211}}) {
    SceneLinear picture = noisy_linear(width, height);
    picture.plane[0].at(0, 0) = std::numeric_limits<float>::quiet_NaN();
    for (const Compression compression : {Compression::none, Compression::piz}) {
      const auto decoded = decode_exr(exr_of(picture, Depth::full, {}, compression));
      ASSERT_TRUE(decoded) << decoded.error().message;
      EXPECT_TRUE(test::same_bits(picture, std::get<SceneLinear>(decoded->picture)));
    }
  }
}

TEST(Exr, HalfIsWithinHalfAStepOfElevenBits) {
  const SceneLinear picture = noisy_linear(67, 45);
  const auto decoded = decode_exr(exr_of(picture, Depth::half));
  ASSERT_TRUE(decoded) << decoded.error().message;
  const auto& read = std::get<SceneLinear>(decoded->picture);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < picture.plane[c].size(); ++i) {
      const float value = picture.plane[c].data()[i];
      // 2^-11 relative for normal halves, 2^-25 absolute for those below 2^-14
      const double bound = std::max(std::ldexp(std::fabs(double{value}), -11), std::ldexp(1.0, -25));
      ASSERT_NEAR(read.plane[c].data()[i], value, bound);
    }
  }
}

TEST(Exr, CompressionIsSmallerAndChangesNoHalf) {
  SceneLinear picture = noisy_linear(67, 75);
  for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size() / 2, 0.18f);
  const auto plain = exr_of(picture, Depth::half), packed = exr_of(picture, Depth::half, {}, Compression::piz);
  EXPECT_LT(packed.size(), plain.size());
  const auto a = decode_exr(plain), b = decode_exr(packed);
  ASSERT_TRUE(a && b);
  EXPECT_TRUE(test::same_bits(std::get<SceneLinear>(a->picture), std::get<SceneLinear>(b->picture)));
}

TEST(Exr, HalfHoldsWhatLiesBeyondItsRange) {
  SceneLinear picture = noisy_linear(3, 1);
  picture.plane[0].at(0, 0) = 1e9f;
  picture.plane[1].at(1, 0) = -std::numeric_limits<float>::infinity();
  picture.plane[2].at(2, 0) = std::numeric_limits<float>::quiet_NaN();
  const auto decoded = decode_exr(exr_of(picture, Depth::half));
  ASSERT_TRUE(decoded);
  const auto& read = std::get<SceneLinear>(decoded->picture);
  EXPECT_EQ(read.plane[0].at(0, 0), 65504.0f);
  EXPECT_EQ(read.plane[1].at(1, 0), -65504.0f);
  EXPECT_TRUE(std::isnan(read.plane[2].at(2, 0)));
}

TEST(Exr, ChromaticitiesAndExposureComeBack) {
  FileMetadata metadata;
  metadata.chromaticities = Chromaticities{{0.5, 0.25}, {0.25, 0.5}, {0.125, 0.0625}, {0.3125, 0.375}};  // exact floats
  metadata.info.exposure_s = 0.25;
  metadata.info.f_number = 2;
  metadata.info.iso = 409600;
  metadata.info.make = "Maker";
  metadata.info.model = "Model 1";
  metadata.info.software = "lowlux 1";
  metadata.info.date_time = "2024:02:03 04:05:06";
  const auto decoded = decode_exr(exr_of(noisy_linear(5, 4), Depth::half, metadata));
  ASSERT_TRUE(decoded) << decoded.error().message;
  const FileMetadata& read = decoded->metadata;
  EXPECT_EQ(read.chromaticities, metadata.chromaticities);
  EXPECT_EQ(read.info.exposure_s, 0.25);
  EXPECT_EQ(read.info.f_number, 2);
  EXPECT_EQ(read.info.iso, 409600);
  EXPECT_EQ(read.info.make, "Maker");
  EXPECT_EQ(read.info.model, "Model 1");
  EXPECT_EQ(read.info.software, "lowlux 1");
  EXPECT_EQ(read.info.date_time, "2024:02:03 04:05:06");
}

TEST(Exr, CaptionAuthorLensAndPlaceBecomeAttributes) {
  const auto text = [](std::uint16_t id, std::string_view words) {
    SourceTag tag{.id = id, .type = 2, .count = static_cast<std::uint32_t>(words.size() + 1)};
    for (const char c : words) tag.values.push_back(static_cast<std::byte>(c));
    tag.values.push_back(std::byte{0});
    return tag;
  };
  const auto fractions = [](std::uint16_t id, const std::vector<std::uint32_t>& terms) {
    SourceTag tag{.id = id, .type = 5, .count = static_cast<std::uint32_t>(terms.size() / 2)};
    for (const std::uint32_t term : terms) {
      for (int i = 0; i < 4; ++i) tag.values.push_back(static_cast<std::byte>(term >> (8 * i) & 255U));
    }
    return tag;
  };
  SourceTags tags;
  tags.main = {text(270, "A bridge"), text(315, "An author"), text(33432, "A right")};
  tags.exif = {text(42033, "C1"), text(42035, "Maker"), text(42036, "A Lens 24-70"), text(42037, "L2")};
  tags.gps = {text(1, "S"),
              fractions(2, {33, 1, 51, 1, 30, 1}),
              text(3, "W"),
              fractions(4, {70, 1, 30, 1, 0, 1}),
              SourceTag{5, 1, 1, {std::byte{1}}},
              fractions(6, {25, 2})};
  FileMetadata metadata;
  metadata.info.focal_length_mm = 35;
  metadata.source_tags = std::make_shared<const SourceTags>(tags);
  const auto header = [&] {
    const std::vector<std::byte> bytes = exr_of(noisy_linear(5, 4), Depth::half, metadata);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const auto attribute = [](const std::string& file, const std::string& name, const std::string& type) {
    const std::string key = name + '\0' + type + '\0';
    const std::size_t at = file.find(key);
    if (at == std::string::npos) return std::string("absent");
    std::uint32_t size = 0;
    std::memcpy(&size, file.data() + at + key.size(), sizeof size);
    return file.substr(at + key.size() + sizeof size, size);
  };
  const auto number = [&](const std::string& file, const std::string& name) {
    float value = NAN;
    const std::string bytes = attribute(file, name, "float");
    if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  };
  const std::string file = header();
  for (const auto& [name, words] : std::vector<std::pair<std::string, std::string>>{{"comments", "A bridge"},
                                                                                    {"owner", "An author"},
                                                                                    {"copyright", "A right"},
                                                                                    {"cameraSerialNumber", "C1"},
                                                                                    {"lensMake", "Maker"},
                                                                                    {"lensModel", "A Lens 24-70"},
                                                                                    {"lensSerialNumber", "L2"}}) {
    EXPECT_EQ(attribute(file, name, "string"), words) << name;
  }
  EXPECT_FLOAT_EQ(number(file, "latitude"), -(33 + 51 / 60.0F + 30 / 3600.0F));
  EXPECT_FLOAT_EQ(number(file, "longitude"), -70.5F);
  EXPECT_FLOAT_EQ(number(file, "altitude"), -12.5F);
  EXPECT_FLOAT_EQ(number(file, "nominalFocalLength"), 35);
  // Damaged tags are left out: a divisor of 0, and a text of another type.
  tags.gps[1] = fractions(2, {33, 0, 51, 1, 30, 1});
  tags.gps[3] = fractions(4, {70, 1, 30, 1, 0, 0});  // unknown seconds
  tags.main[1].type = 7;
  metadata.source_tags = std::make_shared<const SourceTags>(tags);
  const std::string damaged = header();
  EXPECT_EQ(attribute(damaged, "latitude", "float"), "absent");
  EXPECT_FLOAT_EQ(number(damaged, "longitude"), -70.5F);
  EXPECT_EQ(attribute(damaged, "owner", "string"), "absent");
  EXPECT_EQ(attribute(damaged, "comments", "string"), "A bridge");
}

TEST(Exr, TheLuminanceOfWhiteComesBackIfItIsOne) {
  const auto read_back = [](double cd_m2) {
    FileMetadata metadata;
    metadata.white_luminance_cd_m2 = cd_m2;
    const auto decoded = decode_exr(exr_of(noisy_linear(5, 4), Depth::half, metadata));
    return decoded ? decoded->metadata.white_luminance_cd_m2 : std::optional<double>(-1);
  };
  EXPECT_EQ(read_back(0.125), 0.125);  // an exact float
  for (const double none : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) EXPECT_FALSE(read_back(none));
}

TEST(Exr, WhatIsUnknownStaysAbsent) {
  const auto decoded = decode_exr(exr_of(noisy_linear(5, 4), Depth::half));
  ASSERT_TRUE(decoded);
  EXPECT_FALSE(decoded->metadata.chromaticities);
  EXPECT_FALSE(decoded->metadata.info.exposure_s || decoded->metadata.info.iso || decoded->metadata.info.f_number);
  EXPECT_FALSE(decoded->metadata.white_luminance_cd_m2);
}

TEST(Exr, AFullDiskIsAnErrorThatSaysSo) {
  const SceneLinear picture = noisy_linear(300, 211);
  for (const Compression compression : {Compression::none, Compression::piz}) {
    test::expect_full_disks_are_reported([&](std::FILE* f) {
      return encode_exr(picture, {}, {Depth::half, compression}, f);
    });
  }
}

/// Renames a channel in the header's list, where a name and its zero byte precede the pixel type.
std::vector<std::byte> with_channel_renamed(std::vector<std::byte> bytes, char from, char to) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view list("channels\0chlist\0", 16);
  const std::size_t start = text.find(list) + list.size();
  bytes[text.find(std::string{from, '\0'}, start)] = static_cast<std::byte>(to);
  return bytes;
}

TEST(ExrOfOthers, AFileWithYOnlyIsGrey) {
  const SceneLinear picture = noisy_linear(5, 4);
  const auto decoded = decode_exr(with_channel_renamed(exr_of(picture, Depth::full), 'R', 'Y'));
  ASSERT_TRUE(decoded) << decoded.error().message;
  for (const auto& plane : std::get<SceneLinear>(decoded->picture).plane) {
    EXPECT_TRUE(test::same_bits(plane, picture.plane[0]));
  }
}

TEST(ExrOfOthers, AFileWithoutColourOrGreyIsRefusedByName) {
  const auto decoded = decode_exr(with_channel_renamed(exr_of(noisy_linear(5, 4), Depth::full), 'R', 'Z'));
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::unsupported);
}

TEST(ExrOfOthers, MorePixelsThanTheLimitAreTooLarge) {
  const auto bytes = exr_of(noisy_linear(20, 10), Depth::half);
  EXPECT_TRUE(decode_exr(bytes, {.max_pixels = 200}));
  const auto decoded = decode_exr(bytes, {.max_pixels = 199});
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::isp
