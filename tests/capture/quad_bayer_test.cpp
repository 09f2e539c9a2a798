// Quad Bayer mosaics from the file to the binned frame, against sums of the test's own.
#include "capture/dng/quad_bayer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "isp/base/gain_at.h"
#include "tests/capture/read_built.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/dng/drawn_opcodes.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::Tag;
using test::TagType;

/// Returns the colour of a site whose pattern of blocks begins at (left, top).
int colour_of(BayerPhase phase, int x, int y, int left, int top) {
  return static_cast<int>(colour_at(phase, (x - left + 8) / 2, (y - top + 8) / 2));
}

/// A file of random codes below 1000, whose first complete block begins at (left, top) of the active area.
DngBuilder quad_dng(BayerPhase phase, int left, int top, std::mt19937& draw) {
  DngBuilder dng;
  dng.width = 28 + static_cast<int>(draw() % 20), dng.height = 28 + static_cast<int>(draw() % 20);
  dng.bits = 12;
  for (int i = 0; i < dng.width * dng.height; ++i) dng.pixels.push_back(static_cast<std::uint16_t>(draw() % 1000));
  std::vector<double> colours;
  colours.reserve(16);
  for (int i = 0; i < 16; ++i) colours.push_back(colour_of(phase, i % 4, i / 4, left, top));
  dng.set(33421, Tag::numbers(TagType::u16, {4, 4}));
  dng.set(33422, Tag::numbers(TagType::byte, colours));
  return dng;
}

void set_active(DngBuilder& dng, const Rect& active) {
  dng.set(50829, Tag::numbers(TagType::u32, {static_cast<double>(active.y), static_cast<double>(active.x),
                                             static_cast<double>(active.y + active.height),
                                             static_cast<double>(active.x + active.width)}));
}

TEST(QuadBayer, EveryPhaseCornerAndActiveAreaGivesTheSumsOfItsBlocks) {
  std::mt19937 draw(20261125);
  for (int i = 0; i < 64; ++i) {
    const auto phase = static_cast<BayerPhase>(i % 4);
    const int left = i / 4 % 2, top = i / 8 % 2;
    DngBuilder dng = quad_dng(phase, left, top, draw);
    const Rect active{static_cast<int>(draw() % 4), static_cast<int>(draw() % 4), dng.width - 4, dng.height - 5};
    set_active(dng, active);
    SCOPED_TRACE("seed 20261125, file " + std::to_string(i));
    const RawFrame frame = test::read_built(dng);
    const RawDn& raw = frame.raw;
    ASSERT_EQ(raw.layout, SensorLayout::bayer);
    EXPECT_EQ(raw.phase, phase);
    ASSERT_FALSE(raw.is_float());
    ASSERT_EQ(raw.active.width, (active.width - left) / 2);
    ASSERT_EQ(raw.active.height, (active.height - top) / 2);
    EXPECT_EQ(raw.default_crop, (Rect{0, 0, raw.active.width, raw.active.height}));
    for (int y = 0; y < raw.active.height; ++y) {
      for (int x = 0; x < raw.active.width; ++x) {
        int sum = 0;
        for (int site = 0; site < 4; ++site) {
          const int column = active.x + left + 2 * x + site % 2, row = active.y + top + 2 * y + site / 2;
          sum += dng.pixels[static_cast<std::size_t>(row) * dng.width + column];
        }
        ASSERT_EQ(raw.dn.at(raw.active.x + x, raw.active.y + y), sum) << x << ", " << y;
      }
    }
    EXPECT_EQ(raw.white_dn, (std::array<double, 3>{4 * 4095, 4 * 4095, 4 * 4095}));
    ASSERT_TRUE(raw.black_tag);
    EXPECT_EQ(raw.black_tag->at(0, 0), 4 * 64);
    ASSERT_EQ(frame.warnings.size(), 1U);
    EXPECT_NE(frame.warnings[0].find("Quad Bayer"), std::string::npos);
  }
}

TEST(QuadBayer, BlackLevelsOfAPatternOfColumnsAndOfRowsAreSummed) {
  std::mt19937 draw(3);
  DngBuilder dng = quad_dng(BayerPhase::grbg, 1, 0, draw);
  std::vector<double> pattern, columns, rows;
  for (int i = 0; i < 16; ++i) pattern.push_back(60 + i);
  for (int i = 0; i < dng.width; ++i) columns.push_back(i % 7);
  for (int i = 0; i < dng.height; ++i) rows.push_back(i % 5);
  dng.set(50713, Tag::numbers(TagType::u16, {4, 4}));
  dng.set(50714, Tag::numbers(TagType::u16, pattern));
  dng.set(50715, Tag::numbers(TagType::f64, columns));
  dng.set(50716, Tag::numbers(TagType::f64, rows));
  const RawFrame frame = test::read_built(dng);
  ASSERT_TRUE(frame.raw.black_tag);
  for (int y = 0; y < frame.raw.active.height; ++y) {
    for (int x = 0; x < frame.raw.active.width; ++x) {
      double sum = 0;
      for (int site = 0; site < 4; ++site) {
        const int column = 1 + 2 * x + site % 2, row = 2 * y + site / 2;
        sum += pattern[row % 4 * 4 + column % 4] + columns[column] + rows[row];
      }
      ASSERT_DOUBLE_EQ(frame.raw.black_tag->at(x, y), sum) << x << ", " << y;
    }
  }
}

TEST(QuadBayer, ABlockWithASaturatedSiteIsSaturated) {
  std::mt19937 draw(5);
  DngBuilder dng = quad_dng(BayerPhase::rggb, 0, 0, draw);
  dng.pixels[5 * dng.width + 6] = 4095;
  const RawFrame frame = test::read_built(dng);
  EXPECT_EQ(frame.raw.dn.at(3, 2), 4 * 4095);
  EXPECT_LT(frame.raw.dn.at(2, 2), 4 * 1000);
}

TEST(QuadBayer, SumsThatCodesCannotHoldAreFloatingPointSamples) {
  std::mt19937 draw(7);
  DngBuilder dng = quad_dng(BayerPhase::bggr, 0, 0, draw);
  dng.bits = 16;
  for (std::uint16_t& pixel : dng.pixels) pixel = static_cast<std::uint16_t>(draw() % 65535);
  const RawFrame frame = test::read_built(dng);
  ASSERT_TRUE(frame.raw.is_float());
  const auto at = [&](int x, int y) {
    return static_cast<int>(dng.pixels[static_cast<std::size_t>(y) * dng.width + x]);
  };
  EXPECT_EQ(frame.raw.dn_float.at(4, 3), static_cast<float>(at(8, 6) + at(9, 6) + at(8, 7) + at(9, 7)));
  EXPECT_EQ(frame.raw.white_dn[0], 4.0 * 65535);
}

TEST(QuadBayer, NoiseIsThatOfTheMeanOfFour) {
  std::mt19937 draw(9);
  DngBuilder dng = quad_dng(BayerPhase::gbrg, 0, 1, draw);
  dng.set(51041, Tag::numbers(TagType::f64, {2e-4, 3e-6}));
  const RawFrame frame = test::read_built(dng);
  ASSERT_TRUE(frame.noise);
  EXPECT_EQ(frame.noise->scale[1], 2e-4 / 4);
  EXPECT_EQ(frame.noise->offset[1], 3e-6 / 4);
}

TEST(QuadBayer, AreasKeepCompleteBlocksAndDefectsThoseTheyTouch) {
  RawFrame frame;
  frame.raw.dn = Plane<std::uint16_t>(40, 30);
  std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), std::uint16_t{100});
  frame.raw.active = {8, 0, 32, 30};
  frame.raw.default_crop = {3, 2, 20, 21};
  frame.raw.masked = {{0, 0, 7, 30}, {7, 0, 1, 30}};
  frame.raw.white_dn = {1000, 1000, 1000};
  frame.corrections.defects = {{5, 4, 2, 1}, {31, 29, 1, 1}};
  frame.corrections.gain_maps = {{.top = 0, .left = 1, .bottom = 30, .right = 32}};
  ASSERT_TRUE(bin_quad_bayer({}, frame));
  EXPECT_EQ(frame.raw.active, (Rect{4, 0, 16, 15}));
  EXPECT_EQ(frame.raw.default_crop, (Rect{2, 1, 9, 10}));
  ASSERT_EQ(frame.raw.masked.size(), 1U);
  EXPECT_EQ(frame.raw.masked[0], (Rect{0, 0, 3, 15}));
  ASSERT_EQ(frame.corrections.defects.size(), 2U);
  EXPECT_EQ(frame.corrections.defects[0].x, 2);
  EXPECT_EQ(frame.corrections.defects[0].width, 2);
  EXPECT_EQ(frame.corrections.defects[1].x, 15);
  EXPECT_EQ(frame.corrections.defects[1].y, 14);
  ASSERT_EQ(frame.corrections.gain_maps.size(), 1U);
  EXPECT_EQ(frame.corrections.gain_maps[0].left, 1);
  EXPECT_EQ(frame.corrections.gain_maps[0].right, 16);
  EXPECT_EQ(frame.warnings.size(), 1U);
}

TEST(QuadBayer, ScalesOfRowsAndColumnsAreTheMeansOfThoseOfABlock) {
  std::mt19937 draw(31);
  for (int i = 0; i < 32; ++i) {
    const int left = i % 2, top = i / 2 % 2;
    DngBuilder dng = quad_dng(BayerPhase::rggb, left, top, draw);
    const bool of_rows = i / 4 % 2 == 0;
    const int lines = of_rows ? dng.height : dng.width, skipped = of_rows ? top : left;
    const int pitch = 1 + i / 8 % 2;
    test::Opcode scale =
        test::words(of_rows ? 12 : 13,
                    {0, 0, static_cast<std::uint32_t>(dng.height), static_cast<std::uint32_t>(dng.width), 0, 1,
                     static_cast<std::uint32_t>(of_rows ? pitch : 1), static_cast<std::uint32_t>(of_rows ? 1 : pitch),
                     static_cast<std::uint32_t>((lines + pitch - 1) / pitch)});
    std::vector<float> gains;
    for (int line = 0; line < lines; ++line) gains.push_back(0.5F + static_cast<float>(draw() % 1000) / 1000);
    for (int line = 0; line < (lines + pitch - 1) / pitch; ++line) {
      test::append_f32(scale.parameters, gains[static_cast<std::size_t>(line)]);
    }
    dng.set(test::opcode_list2, test::opcode_list({scale}));
    const RawFrame frame = test::read_built(dng);
    if (pitch > 1) {
      EXPECT_TRUE(frame.corrections.gain_maps.empty());
      ASSERT_EQ(frame.warnings.size(), 2U);
      EXPECT_EQ(frame.warnings[0], std::string(of_rows ? "ScalePerRow" : "ScalePerColumn") +
                                       " (OpcodeList2) is not applied: it skips sites of a Quad Bayer mosaic, which is "
                                       "binned");
      continue;
    }
    ASSERT_EQ(frame.corrections.gain_maps.size(), 1U);
    const GainMap& map = frame.corrections.gain_maps[0];
    const int blocks = of_rows ? frame.raw.active.height : frame.raw.active.width;
    for (int block = 0; block < blocks; ++block) {
      const GridPosition at = of_rows ? row_position(map, block, blocks) : column_position(map, block, blocks);
      const GridPosition other{0, 0, 0};
      const float gain = of_rows ? gain_at(map, at, other, 0) : gain_at(map, other, at, 0);
      const std::size_t first = static_cast<std::size_t>(skipped + 2 * block);
      ASSERT_NEAR(gain, (gains[first] + gains[first + 1]) / 2, 1e-5) << "file " << i << ", block " << block;
    }
  }
}

TEST(QuadBayer, DeltasAndMapsAreAppliedToSites) {
  for (unsigned seed = 0; seed < 32; ++seed) {
    std::mt19937 draw(seed);
    const int left = static_cast<int>(draw() % 2), top = static_cast<int>(draw() % 2);
    DngBuilder dng = quad_dng(BayerPhase::rggb, left, top, draw);
    std::vector<test::DrawnOpcode> opcodes;
    std::vector<test::Opcode> encoded;
    for (unsigned i = 1 + draw() % 3; i > 0; --i) {
      const std::uint32_t id = seed % 2 == 0 ? 10 + draw() % 2 : 7 + 3 * (draw() % 2);
      opcodes.push_back(test::draw_opcode(id, {.list = 2, .width = dng.width, .height = dng.height}, draw));
      encoded.push_back(opcodes.back().encoded);
    }
    dng.set(test::opcode_list2, test::opcode_list(encoded));
    const RawFrame frame = test::read_built(dng);
    const bool maps = std::ranges::any_of(opcodes, &test::DrawnOpcode::is_map);
    const double site_range = maps ? (frame.raw.white_dn[0] - frame.raw.black_tag->at(0, 0)) / 4 : 4095 - 64;
    for (int y = 0; y < frame.raw.active.height; ++y) {
      for (int x = 0; x < frame.raw.active.width; ++x) {
        double sum = 0;
        for (int site = 0; site < 4; ++site) {
          const int column = left + 2 * x + site % 2, row = top + 2 * y + site / 2;
          double value = (dng.pixels[static_cast<std::size_t>(row) * dng.width + column] - 64.0) / (4095 - 64);
          for (const test::DrawnOpcode& opcode : opcodes) value = opcode.truth(value, column, row, 0);
          sum += value;
        }
        const int at = frame.raw.active.x + x, line = frame.raw.active.y + y;
        const double dn =
            frame.raw.is_float() ? static_cast<double>(frame.raw.dn_float.at(at, line)) : frame.raw.dn.at(at, line);
        // Four codes of 16 bits are rounded after maps.
        ASSERT_NEAR((dn - frame.raw.black_tag->at(x, y)) / site_range, sum, (maps ? 4 * 0.5 / site_range : 0) + 1e-6)
            << "seed " << seed << ": " << x << ", " << y;
      }
    }
  }
}

TEST(QuadBayer, OtherPatternsAndAreasWithoutABlockAreRefused) {
  std::mt19937 draw(11);
  DngBuilder other = quad_dng(BayerPhase::rggb, 0, 0, draw);
  other.set(33422, Tag::numbers(TagType::byte, std::vector<double>(16, 1)));
  EXPECT_NE(test::refused(other).message.find("not Quad Bayer"), std::string::npos);
  RawFrame small;
  small.raw.dn = Plane<std::uint16_t>(6, 6);
  std::fill_n(small.raw.dn.data(), small.raw.dn.size(), std::uint16_t{0});
  small.raw.active = {3, 1, 2, 4};
  const auto binned = bin_quad_bayer({BayerPhase::rggb, 1, 0}, small);
  ASSERT_FALSE(binned);
  EXPECT_NE(binned.error().message.find("2 x 4"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::capture
