// X-Trans mosaics from the file to the frame: levels, noise, areas, corrections.
#include "capture/x_trans/x_trans_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/file/decoder_frame.h"
#include "tests/capture/read_built.h"
#include "tests/capture/x_trans_colours.h"
#include "tests/support/dng/float_dng.h"
#include "tests/support/dng/opcode_list.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::Tag;
using test::TagType;

/// The code of a site by its colour, above black.
constexpr std::array<int, 3> code{1500, 4000, 2400};

/// A DNG whose active area begins at a corner and has one value in each colour.
DngBuilder x_trans_dng(const XTransPhase& phase, int left = 0, int top = 0, int black = 64) {
  DngBuilder dng;
  dng.width = 44, dng.height = 38;
  for (int y = 0; y < dng.height; ++y) {
    for (int x = 0; x < dng.width; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(phase, x - left, y - top));
      dng.pixels.push_back(static_cast<std::uint16_t>(black + code[c]));
    }
  }
  dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
  dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours(phase)));
  if (left + top > 0) {
    dng.set(50829, Tag::numbers(TagType::u32, {static_cast<double>(top), static_cast<double>(left), 38, 44}));
  }
  return dng;
}

void expect_colours(const RawFrame& frame, double black_dn = 64) {
  const RawDn& raw = frame.raw;
  ASSERT_EQ(raw.layout, SensorLayout::linear_rgb);
  ASSERT_TRUE(raw.is_float() && raw.from_x_trans && raw.dn.empty());
  for (std::size_t i = 0; i < raw.dn_float.size(); ++i) {
    ASSERT_NEAR(raw.dn_float.data()[i], black_dn + code[i % 3], 0.05) << i;  // 1e-5 of the largest code
  }
}

TEST(XTransFrame, EveryPhaseIsReadAsThreeColours) {
  for (int i = 0; i < 36; ++i) {
    const int left = i % 3, top = i % 5;
    const RawFrame frame = test::read_built(x_trans_dng({i % 6, i / 6}, left, top));
    expect_colours(frame);
    EXPECT_EQ(frame.raw.active, (Rect{0, 0, 44 - left, 38 - top}));
    EXPECT_EQ(frame.raw.default_crop, frame.raw.active);
    EXPECT_TRUE(frame.raw.masked.empty());
    ASSERT_TRUE(frame.raw.black_tag);
    EXPECT_EQ(frame.raw.black_tag->samples, 3);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(frame.raw.black_tag->at(0, 0, c), 64);
    EXPECT_EQ(frame.raw.white_dn, (std::array<double, 3>{65535, 65535, 65535}));
    EXPECT_TRUE(frame.warnings.empty());
  }
}

TEST(XTransFrame, FloatingPointMosaicsOfAnySizeAreReadToo) {
  for (const int side : {1, 2, 5, 40}) {
    Plane<float> value(side, side);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x)
        value.at(x, y) = 0.25F + 0.25F * static_cast<float>(colour_at(XTransPhase{2, 1}, x, y));
    }
    DngBuilder dng = test::float_dng(value, 1);
    dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
    dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours({2, 1})));
    const RawDn raw = test::read_built(dng).raw;
    ASSERT_EQ(raw.dn_float.width(), 3 * side);
    ASSERT_TRUE(raw.from_x_trans);
    for (int c = 0; side > 2 && c < 3; ++c) EXPECT_NEAR(raw.dn_float.at(c, 0), 0.25 + 0.25 * c, 1e-5);
  }
}

TEST(XTransFrame, BlackOfAPatternBecomesOneForEachColour) {
  DngBuilder dng = x_trans_dng({0, 0});
  for (int i = 0; i < dng.width * dng.height; ++i)
    dng.pixels[i] = static_cast<std::uint16_t>(dng.pixels[i] + i % 2 * 10);
  dng.set(50713, Tag::numbers(TagType::u16, {1, 2}));
  dng.set(50714, Tag::numbers(TagType::u16, {64, 74}));
  expect_colours(test::read_built(dng), 69);  // every colour is in even and odd columns alike
}

TEST(XTransFrame, BlackThatIsNotStatedIsMeasuredOnStatedMaskedAreas) {
  DngBuilder dng = x_trans_dng({1, 4}, 8, 0, 100);
  for (int y = 0; y < dng.height; ++y) {
    for (int x = 0; x < 8; ++x) dng.pixels[y * dng.width + x] = 100;
  }
  dng.remove(50714);
  dng.set(50830, Tag::numbers(TagType::u32, {0, 0, 38, 8}));
  const RawFrame frame = test::read_built(dng);
  expect_colours(frame, 100);
  ASSERT_TRUE(frame.raw.black_tag);
  EXPECT_EQ(frame.raw.black_tag->at(0, 0, 1), 100);
}

TEST(XTransFrame, NoiseIsThatOfTheDensityOfEachColour) {
  DngBuilder dng = x_trans_dng({3, 2});
  dng.set(51041, Tag::numbers(TagType::f64, {2e-4, 3e-6}));
  const RawFrame frame = test::read_built(dng);
  ASSERT_TRUE(frame.noise);
  const std::array<double, 3> density{8.0 / 36, 20.0 / 36, 8.0 / 36};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_DOUBLE_EQ(frame.noise->scale[c], 2e-4 / density[c]);
    EXPECT_DOUBLE_EQ(frame.noise->offset[c], 3e-6 / density[c]);
  }
}

TEST(XTransFrame, NoiseThatIsNotStatedIsMeasuredOnTheMosaic) {
  DngBuilder dng = x_trans_dng({1, 1});
  dng.width = dng.height = 240;
  dng.pixels.resize(240 * 240);
  std::mt19937 draw(20261125);
  std::normal_distribution<double> noise(0, 1);
  for (int y = 0; y < dng.height; ++y) {
    for (int x = 0; x < dng.width; ++x) {  // 2 DN/e- and 3 e- of read noise; white 65535
      const double mean = x < dng.width / 2 ? 800 : 8000;
      dng.pixels[y * dng.width + x] =
          static_cast<std::uint16_t>(std::lround(64 + mean + std::sqrt(2 * mean + 36) * noise(draw)));
    }
  }
  const RawFrame frame = test::read_built(dng);
  ASSERT_TRUE(frame.noise);
  EXPECT_EQ(frame.noise->source, NoiseProfile::Source::picture);
  const double range = frame.raw.white_dn[1] - 64, density = 20.0 / 36;
  for (const double mean : {800.0, 8000.0}) {
    const double variance = frame.noise->scale[1] * mean / range + frame.noise->offset[1];
    // The variance from a quartile of 3,200 differences has a standard error of 6.3 %.
    EXPECT_NEAR(variance * density * range * range / (2 * mean + 36), 1, 5 * 0.063) << mean;
  }
  EXPECT_DOUBLE_EQ(frame.noise->scale[0] * 8, frame.noise->scale[1] * 20);
}

TEST(XTransFrame, SaturatedSitesStayAtWhite) {
  DngBuilder dng = x_trans_dng({2, 2});
  dng.set(50717, Tag::numbers(TagType::u16, {4000 + 64}));  // green saturates
  const RawFrame frame = test::read_built(dng);
  for (int y = 0; y < dng.height; ++y) {
    for (int x = 0; x < dng.width; ++x) EXPECT_EQ(frame.raw.dn_float.at(3 * x + 1, y), 4064);
  }
}

TEST(XTransFrame, DefectsThatTheFileNamesAreRepaired) {
  DngBuilder dng = x_trans_dng({0, 5});
  dng.pixels[10 * dng.width + 12] = 300;
  dng.pixels[11 * dng.width + 12] = 9;
  std::vector<std::byte> list;
  for (const std::uint32_t word : {0U, 2U, 0U, 10U, 12U, 11U, 12U}) test::append_u32(list, word);
  dng.set(51008, test::opcode_list({{.id = 5, .parameters = list}}));
  const RawFrame frame = test::read_built(dng);
  expect_colours(frame);
  EXPECT_TRUE(frame.corrections.defects.empty());

  DngBuilder constant = x_trans_dng({0, 5});
  constant.pixels[10 * constant.width + 12] = 4;
  std::vector<std::byte> value;
  for (const std::uint32_t word : {4U, 0U}) test::append_u32(value, word);
  constant.set(51008, test::opcode_list({{.id = 4, .parameters = value}}));
  expect_colours(test::read_built(constant));
}

TEST(XTransFrame, DeltasAndMapsOfTheMosaicAreAppliedBeforeItIsInterpolated) {
  constexpr double range_dn = 65535 - 64;
  std::mt19937 draw(11);
  for (int i = 0; i < 12; ++i) {
    DngBuilder dng = x_trans_dng({i % 6, i / 2});
    const int list = 1 + i % 2, left = static_cast<int>(draw() % 6), pitch = 1 + static_cast<int>(draw() % 3);
    const bool has_map = list == 2 && i % 4 == 3;
    if (has_map) {
      for (std::uint16_t& pixel : dng.pixels) pixel = static_cast<std::uint16_t>(64 + 2 * (pixel - 64));
    }
    test::Opcode deltas =
        test::words(10, {0, static_cast<std::uint32_t>(left), 38, 44, 0, 1, 1, static_cast<std::uint32_t>(pitch), 38});
    for (int y = 0; y < 38; ++y) {
      const int delta = static_cast<int>(draw() % 60) - 30;
      test::append_f32(deltas.parameters, static_cast<float>(list == 1 ? delta : delta / range_dn));
      for (int x = left; x < 44; x += pitch) {
        std::uint16_t& pixel = dng.pixels[static_cast<std::size_t>(y) * 44 + static_cast<std::size_t>(x)];
        pixel = static_cast<std::uint16_t>(pixel - delta);
      }
    }
    test::Opcode half = test::words(8, {0, 0, 38, 44, 0, 1, 1, 1, 1});
    for (const double k : {0.0, 0.5}) test::append_f64(half.parameters, k);
    dng.set(list == 1 ? test::opcode_list1 : test::opcode_list2,
            has_map ? test::opcode_list({deltas, half}) : test::opcode_list({deltas}));
    const RawFrame frame = test::read_built(dng);
    EXPECT_TRUE(frame.warnings.empty());
    for (int at = 0; at < static_cast<int>(frame.raw.dn_float.size()); ++at) {
      const double black_dn = frame.raw.black_tag->at(0, 0, at % 3);
      const double scale = has_map ? range_dn / (frame.raw.white_dn[0] - black_dn) : 1;
      const double dn = (static_cast<double>(frame.raw.dn_float.data()[at]) - black_dn) * scale;
      // 1e-5 of the largest code, deltas as floats, and half a code of those after maps.
      ASSERT_NEAR(dn, code[static_cast<std::size_t>(at % 3)], has_map ? 0.6 : 0.06)
          << "file " << i << ", sample " << at;
    }
  }
}

TEST(XTransFrame, GainMapsOfTheMosaicAreForAllPlanes) {
  const auto with_pitch = [](std::uint32_t pitch) {
    std::vector<std::byte> map;
    for (const std::uint32_t word : {0U, 0U, 38U, 44U, 0U, 1U, pitch, pitch, 1U, 1U}) test::append_u32(map, word);
    for (const double number : {1.0, 1.0, 0.0, 0.0}) test::append_f64(map, number);
    test::append_u32(map, 1);
    test::append_f32(map, 1.5F);
    DngBuilder dng = x_trans_dng({4, 4});
    dng.set(51009, test::opcode_list({{.id = 9, .parameters = map}}));
    return test::read_built(dng);
  };
  const RawFrame all = with_pitch(1);
  ASSERT_EQ(all.corrections.gain_maps.size(), 1u);
  EXPECT_EQ(all.corrections.gain_maps[0].planes, 3);
  const RawFrame some = with_pitch(6);
  EXPECT_TRUE(some.corrections.gain_maps.empty());
  ASSERT_EQ(some.warnings.size(), 1u);
  EXPECT_NE(some.warnings[0].find("X-Trans"), std::string::npos);
}

TEST(XTransFrame, TheDecodersReportOfAnXTransRawIsFollowed) {
  DecodedRaw raw;
  DecodedHeader& h = raw.header;
  h.outcome = DecodeOutcome::decoded;
  h.raw_width = 48, h.raw_height = 40, h.samples = 1;
  h.left = 5, h.top = 2, h.width = 40, h.height = 36;
  h.filters = x_trans_filters;
  h.black = 50;
  for (int c = 0; c < 3; ++c) h.channel_black[c] = 14;
  h.maximum = 16383;
  h.camera_multiplier[0] = 2, h.camera_multiplier[1] = 1, h.camera_multiplier[2] = 1.6F;
  h.sensor_temperature_c = h.camera_temperature_c = -1000;
  h.pixel_aspect = 1;
  const XTransPhase phase{4, 1};
  for (int i = 0; i < 36; ++i) h.x_trans[i] = static_cast<std::uint8_t>(colour_at(phase, i % 6, i / 6));
  raw.samples = Plane<std::uint16_t>(48, 40);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 48; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(phase, x - 5, y - 2));
      raw.samples.at(x, y) = static_cast<std::uint16_t>(64 + code[c]);
    }
  }
  DecodedRaw other{h, raw.samples.clone()};
  const auto frame = frame_of_decoder(std::move(raw));
  ASSERT_TRUE(frame) << frame.error().message;
  expect_colours(*frame);
  EXPECT_EQ(frame->raw.active, (Rect{0, 0, 40, 36}));
  other.header.x_trans[7] = 3;
  EXPECT_FALSE(frame_of_decoder(std::move(other)));
}

}  // namespace
}  // namespace lowlux::capture
