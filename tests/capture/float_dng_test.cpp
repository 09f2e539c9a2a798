// Floating-point DNGs: every storage that DNG 1.4 knows, against an oracle of the bit patterns; and those that are
// refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/capture/read_built.h"
#include "tests/support/dng/float_dng.h"
#include "tests/support/peak_memory.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::float_dng;
using test::FloatStore;
using test::has;
using test::Tag;
using test::TagType;

/// Patterns of finite numbers from about 2^-14 to 2^3, of both signs.
Plane<std::uint32_t> patterns_of(int width, int height, int bits, unsigned seed) {
  Plane<std::uint32_t> out(width, height);
  std::mt19937 draw(seed);
  const int exponent_bits = bits == 16 ? 5 : bits == 24 ? 7 : 8, mantissa_bits = bits - 1 - exponent_bits;
  const std::uint32_t bias = (1U << (exponent_bits - 1)) - 1;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint32_t exponent = bias - 14 + draw() % 17, mantissa = draw() >> (32 - mantissa_bits);
    out.data()[i] = (draw() & 1) << (bits - 1) | exponent << mantissa_bits | mantissa;
  }
  return out;
}

Plane<float> plane_of(float value, int width = 24, int height = 24) {
  Plane<float> out(width, height);
  std::fill_n(out.data(), out.size(), value);
  return out;
}

DngBuilder plain(float value = 0.25F) { return float_dng(plane_of(value), 1); }

TEST(FloatDng, EveryStorageGivesTheValuesBitByBit) {
  constexpr unsigned seed = 5;
  for (const int bits : {16, 24, 32}) {
    for (const int samples : {1, 3}) {
      for (const auto& [width, height] : {std::array{1, 1}, {3, 40}, {53, 31}}) {
        const auto patterns = patterns_of(width * samples, height, bits, seed);
        for (const int predictor : {0, 1, 3, 34894, 34895}) {
          for (const auto& [tile, rows] : {std::array{0, 0}, {0, 7}, {16, 16}, {64, 16}}) {
            const FloatStore how{bits, samples, predictor != 0, std::max(predictor, 1), tile, rows, rows == 7};
            const RawFrame frame = test::read_built(float_dng(patterns, how));
            ASSERT_TRUE(frame.raw.is_float());
            EXPECT_TRUE(frame.raw.dn.empty());
            ASSERT_EQ(frame.raw.dn_float.width(), patterns.width());
            ASSERT_EQ(frame.raw.dn_float.height(), height);
            for (std::size_t i = 0; i < patterns.size(); ++i) {
              ASSERT_EQ(static_cast<double>(frame.raw.dn_float.data()[i]),
                        test::value_of_pattern(patterns.data()[i], bits))
                  << bits << " bits, predictor " << predictor << ", tile " << tile << ", rows " << rows << ", seed "
                  << seed;
            }
          }
        }
      }
    }
  }
}

TEST(FloatDng, LevelsThatAreNotStatedAreThoseOfDng) {
  DngBuilder dng = float_dng(plane_of(0.5F), std::nullopt);
  dng.remove(50714);
  const RawDn raw = test::read_built(dng).raw;
  ASSERT_TRUE(raw.black_tag);
  EXPECT_EQ(raw.black_tag->pattern_dn, std::vector<double>{0});
  EXPECT_EQ(raw.white_dn, (std::array<double, 3>{1, 1, 1}));
  DngBuilder rgb = float_dng(Plane<std::uint32_t>(patterns_of(30, 10, 32, 1)), FloatStore{.samples = 3});
  EXPECT_EQ(test::read_built(rgb.remove(50714)).raw.black_tag->samples, 3);
}

TEST(FloatDng, StatedTagsAreReadAsOfCodes) {
  DngBuilder dng = float_dng(plane_of(20000, 40, 30), 16'777'216);
  dng.raw_in_sub_ifd = true;
  dng.phase = BayerPhase::gbrg;
  dng.set(50829, Tag::numbers(TagType::u32, {2, 4, 28, 36}));  // ActiveArea
  dng.set(50714, Tag::numbers(TagType::rational, {512.25}));
  dng.set(51041, Tag::numbers(TagType::f64, {1e-6, 1e-12}));  // NoiseProfile
  dng.set(33434, Tag::rationals(TagType::rational, {{5, 2}}));
  const RawFrame frame = test::read_built(dng);
  EXPECT_EQ(frame.raw.layout, SensorLayout::bayer);
  EXPECT_EQ(frame.raw.phase, BayerPhase::gbrg);
  EXPECT_EQ(frame.raw.active, (Rect{4, 2, 32, 26}));
  EXPECT_EQ(frame.raw.black_tag->pattern_dn, std::vector<double>{512.25});
  EXPECT_EQ(frame.raw.white_dn[1], 16'777'216);
  EXPECT_EQ(frame.raw.info.exposure_s, 2.5);
  EXPECT_EQ(frame.noise->scale[0], 1e-6);
  EXPECT_EQ(frame.colour.calibrations.size(), 1u);
  DngBuilder grey = plain();
  grey.monochrome = true;
  EXPECT_EQ(test::read_built(grey).raw.layout, SensorLayout::monochrome);
}

TEST(FloatDng, WhatIsMeantForCodesBecomesAWarning) {
  std::vector<std::byte> constant;
  for (const std::uint32_t word : {1U, 4U, 0x01030000U, 0U, 8U, 0U, 0U}) test::append_u32(constant, word);
  for (const auto& [id, tag, words] :
       {std::tuple{std::uint16_t{51008}, Tag::opaque(constant), "does not refer to the decoded values"},
        {std::uint16_t{50712}, Tag::numbers(TagType::u16, {0, 1, 2, 3}), "LinearizationTable is not applied"}}) {
    DngBuilder dng = plain();
    const RawFrame frame = test::read_built(dng.set(id, tag));
    ASSERT_EQ(frame.warnings.size(), 1u);
    EXPECT_NE(frame.warnings[0].find(words), std::string::npos) << frame.warnings[0];
    EXPECT_TRUE(frame.corrections.defects.empty());
  }
}

TEST(FloatDng, ValuesThatCannotBeLightAreNamedWithTheirPlace) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::nanf(""), infinity, -infinity, 16'777'218.0F, -3e38F}) {
    for (const bool rgb : {false, true}) {
      Plane<float> values = plane_of(0.5F, rgb ? 90 : 30, 26);
      values.at(rgb ? 3 * 7 + 2 : 7, 11) = bad;
      DngBuilder dng = float_dng(values, std::nullopt);
      if (rgb) {
        dng = float_dng(values, std::nullopt);
        Plane<std::uint32_t> patterns(90, 26);
        for (std::size_t i = 0; i < values.size(); ++i) {
          patterns.data()[i] = std::bit_cast<std::uint32_t>(values.data()[i]);
        }
        dng = float_dng(patterns, FloatStore{.samples = 3});
      }
      const Error error = test::refused(dng);
      EXPECT_EQ(error.code, ErrorCode::malformed);
      EXPECT_TRUE(has(error, "column 7, row 11")) << error.message;
      EXPECT_TRUE(has(error, std::isfinite(bad) ? "more than 2^24 times" : "not a finite number")) << error.message;
    }
  }
  EXPECT_EQ(test::read_built(plain(16'777'216.0F)).raw.dn_float.at(3, 3), 16'777'216.0F);
  EXPECT_EQ(test::read_built(plain(-2)).raw.dn_float.at(3, 3), -2.0F);
}

TEST(FloatDng, WhatIsNotSupportedIsNamed) {
  struct Case {
    std::uint16_t id;
    double value;
    const char* words;
  };
  for (const auto& [id, value, words] : {Case{258, 64, "64 bits per sample"},
                                         {258, 8, "8 bits per sample"},
                                         {259, 52546, "JPEG XL"},
                                         {259, 34892, "lossy JPEG"},
                                         {259, 5, "LZW"},
                                         {262, 2, "no raw image"},
                                         {50717, 0, "WhiteLevel says 0"},
                                         {50714, 1, "not above black level"}}) {
    DngBuilder dng = plain();
    const Error error = test::refused(dng.set(id, Tag::numbers(TagType::u32, {value})));
    EXPECT_TRUE(has(error, words)) << error.message;
  }
  DngBuilder horizontal = float_dng(patterns_of(24, 24, 32, 1), FloatStore{.deflate = true});
  const Error error = test::refused(horizontal.set(317, Tag::numbers(TagType::u16, {2})));
  EXPECT_TRUE(has(error, "predictor 2")) << error.message;
}

TEST(FloatDng, DamagedStorageIsAnError) {
  const auto patterns = patterns_of(40, 40, 16, 3);
  const FloatStore tiles{.bits = 16, .deflate = true, .predictor = 34894, .tile_width = 16, .rows = 16};
  DngBuilder fewer = float_dng(patterns, tiles);
  fewer.stored_parts.pop_back();
  EXPECT_TRUE(has(test::refused(fewer), "needs 9 strips or tiles, the file has 8"));
  DngBuilder cut = float_dng(patterns, tiles);
  cut.stored_parts[4].resize(cut.stored_parts[4].size() / 2);
  EXPECT_TRUE(has(test::refused(cut), "from column 16, row 16 on do not decode"));
  DngBuilder flipped = float_dng(patterns, tiles);
  flipped.stored_parts[8][flipped.stored_parts[8].size() / 2] ^= std::byte{1};
  EXPECT_TRUE(has(test::refused(flipped), "column 32, row 32"));
  for (const std::uint16_t id : {322, 323}) {
    DngBuilder without = float_dng(patterns, tiles);
    EXPECT_TRUE(has(test::refused(without.remove(id)), "is missing"));
    DngBuilder none = float_dng(patterns, tiles);
    EXPECT_EQ(test::refused(none.set(id, Tag::numbers(TagType::u32, {0}))).code, ErrorCode::malformed);
  }
  DngBuilder wide = float_dng(patterns, tiles);
  EXPECT_TRUE(has(test::refused(wide.set(322, Tag::numbers(TagType::u32, {4294967280.0}))),
                  "tiles of 4294967280 x 16 pixels are too large"));
  DngBuilder strip = float_dng(patterns, FloatStore{.bits = 16});
  strip.stored_parts[0].pop_back();
  EXPECT_TRUE(has(test::refused(strip), "3199 bytes, too few for 3200"));
  DngBuilder high = float_dng(patterns, tiles);  // tiles higher than the image, as their last rows are padding
  high.stored_parts = {high.stored_parts[0], high.stored_parts[1], high.stored_parts[2]};
  EXPECT_EQ(test::refused(high.set(323, Tag::numbers(TagType::u32, {4294967295.0}))).code, ErrorCode::malformed);
}

TEST(FloatDng, AFileTooShortForItsSizeTakesNoMemory) {
  for (const bool deflate : {false, true}) {
    DngBuilder dng = float_dng(patterns_of(24, 24, 32, 1), FloatStore{.deflate = deflate});
    dng.set(256, Tag::numbers(TagType::u32, {16000})).set(257, Tag::numbers(TagType::u32, {16000}));
    dng.set(278, Tag::numbers(TagType::u32, {16000}));
    const auto bytes = dng.build();
    const std::int64_t idle = test::peak_bytes([] {});
    const std::int64_t peak =
        test::peak_bytes([&] { EXPECT_TRUE(has(test::refused(bytes), "too few for 1024000000")); });
    EXPECT_LT(peak, idle + (std::int64_t{16} << 20));
  }
  const Error error = test::refused(plain(), {.max_pixels = 575});
  EXPECT_EQ(error.code, ErrorCode::too_large);
}

TEST(FloatDng, EveryTruncationIsAnErrorOrAFrame) {
  const FloatStore how{.bits = 24, .deflate = true, .predictor = 3, .tile_width = 16, .rows = 16};
  const auto bytes = float_dng(patterns_of(30, 24, 24, 2), how).build();
  for (std::size_t size = 0; size < bytes.size(); size += 3) {
    const auto frame = test::read_bytes({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)});
    EXPECT_FALSE(frame) << size;
  }
}

}  // namespace
}  // namespace lowlux::capture
