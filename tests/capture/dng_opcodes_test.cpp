#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "tests/capture/read_built.h"
#include "tests/support/dng/opcode_list.h"
#include "tests/support/peak_memory.h"

namespace lowlux::test {
namespace {

using Bytes = std::vector<std::byte>;

struct MapFields {
  std::uint32_t top = 0, left = 0, bottom = 24, right = 24, plane = 0, planes = 1, row_pitch = 2, column_pitch = 2;
  std::uint32_t points_v = 2, points_h = 3;
  double spacing_v = 1.0, spacing_h = 0.5, origin_v = 0.0, origin_h = 0.0;
  std::uint32_t map_planes = 1;
  std::vector<float> gain = {1, 1.5F, 2, 2.5F, 3, 3.5F};
};

Opcode gain_map(const MapFields& m) {
  Bytes out;
  for (const std::uint32_t field :
       {m.top, m.left, m.bottom, m.right, m.plane, m.planes, m.row_pitch, m.column_pitch, m.points_v, m.points_h}) {
    append_u32(out, field);
  }
  for (const double field : {m.spacing_v, m.spacing_h, m.origin_v, m.origin_h}) append_f64(out, field);
  append_u32(out, m.map_planes);
  for (const float gain : m.gain) append_f32(out, gain);
  return {9, out};
}

Opcode vignette(const std::vector<double>& values) {
  Bytes out;
  for (const double value : values) append_f64(out, value);
  return {3, out};
}

DngBuilder with(std::uint16_t list_tag, const std::vector<Opcode>& opcodes) {
  DngBuilder dng;
  dng.set(list_tag, opcode_list(opcodes));
  return dng;
}

constexpr std::uint16_t list1 = opcode_list1, list2 = opcode_list2, list3 = opcode_list3;

TEST(DngOpcodes, ScalesOfRowsAndColumnsAreGainMapsWithAPointInEach) {
  struct Area {
    std::uint32_t top, left, bottom, right, row_pitch, column_pitch;
  };
  for (const Area& a : {Area{0, 0, 24, 24, 1, 1}, {3, 5, 20, 21, 3, 2}, {1, 0, 24, 9, 2, 5}, {7, 2, 100, 100, 4, 1}}) {
    for (const bool of_rows : {true, false}) {
      const std::uint32_t first = of_rows ? a.top : a.left, pitch = of_rows ? a.row_pitch : a.column_pitch;
      const std::uint32_t end = std::min(of_rows ? a.bottom : a.right, 24U), count = (end - first + pitch - 1) / pitch;
      Opcode scale =
          words(of_rows ? 12 : 13, {a.top, a.left, a.bottom, a.right, 0, 1, a.row_pitch, a.column_pitch, count});
      for (std::uint32_t i = 0; i < count; ++i) append_f32(scale.parameters, 1 + 0.01F * static_cast<float>(i));
      const RawFrame frame = read_built(with(list2, {scale}));
      EXPECT_TRUE(frame.warnings.empty());
      ASSERT_EQ(frame.corrections.gain_maps.size(), 1u);
      const GainMap& map = frame.corrections.gain_maps[0];
      EXPECT_EQ(map.row_pitch, static_cast<int>(a.row_pitch));
      EXPECT_EQ(map.column_pitch, static_cast<int>(a.column_pitch));
      EXPECT_EQ(of_rows ? map.points_h : map.points_v, 1);
      ASSERT_EQ(of_rows ? map.points_v : map.points_h, static_cast<int>(count));
      for (std::uint32_t i = 0; i < count; ++i) {
        const double place = (first + i * pitch + 0.5) / 24;
        const double point = of_rows ? (place - map.origin_v) / map.spacing_v : (place - map.origin_h) / map.spacing_h;
        EXPECT_NEAR(point, i, 1e-12);  // points: rounding
        EXPECT_EQ(map.gain[i], 1 + 0.01F * static_cast<float>(i));
      }
      scale.parameters.resize(scale.parameters.size() - 4);
      const RawFrame damaged = read_built(with(list2, {scale}));
      EXPECT_TRUE(damaged.corrections.gain_maps.empty());
      ASSERT_EQ(damaged.warnings.size(), 1u);
      EXPECT_EQ(damaged.warnings[0].rfind(of_rows ? "ScalePerRow of" : "ScalePerColumn of", 0), 0U);
    }
  }
}

TEST(DngOpcodes, GainsOfAColourThatTheImageLacksAreNotApplied) {
  MapFields fields;
  fields.plane = 1;
  const RawFrame frame = read_built(with(list2, {gain_map(fields)}));
  EXPECT_TRUE(frame.corrections.gain_maps.empty());
  ASSERT_EQ(frame.warnings.size(), 1u);
  EXPECT_EQ(frame.warnings[0], "GainMap (OpcodeList2) is not applied: the image has no colour of its number");
  DngBuilder mono = with(list3, {gain_map(fields)});
  mono.monochrome = true;
  EXPECT_TRUE(read_built(mono).corrections.gain_maps.empty());
  fields.plane = 2;
  DngBuilder colours = with(list2, {gain_map(fields)});
  colours.samples = 3;
  EXPECT_EQ(read_built(colours).corrections.gain_maps.size(), 1u);
}

TEST(DngOpcodes, AGainMapKeepsEveryField) {
  MapFields fields;
  fields.top = 1, fields.left = 0, fields.bottom = 23, fields.right = 100;
  fields.origin_v = 0.25;
  const RawFrame frame = read_built(with(list2, {gain_map(fields)}));
  ASSERT_EQ(frame.corrections.gain_maps.size(), 1u);
  const GainMap& map = frame.corrections.gain_maps[0];
  EXPECT_EQ(map.top, 1);
  EXPECT_EQ(map.left, 0);
  EXPECT_EQ(map.bottom, 23);
  EXPECT_EQ(map.right, 24) << "cut to the active area";
  EXPECT_EQ(map.row_pitch, 2);
  EXPECT_EQ(map.column_pitch, 2);
  EXPECT_EQ(map.points_v, 2);
  EXPECT_EQ(map.points_h, 3);
  EXPECT_EQ(map.spacing_v, 1.0);
  EXPECT_EQ(map.spacing_h, 0.5);
  EXPECT_EQ(map.origin_v, 0.25);
  EXPECT_EQ(map.gain, fields.gain);
  EXPECT_TRUE(frame.warnings.empty());
}

TEST(DngOpcodes, AMapOfDemosaicedDataForAllColoursIsKeptWhole) {
  MapFields fields;
  fields.planes = 3, fields.row_pitch = fields.column_pitch = 1;
  const RawFrame frame = read_built(with(list3, {gain_map(fields)}));
  ASSERT_EQ(frame.corrections.gain_maps.size(), 1u);
  EXPECT_EQ(frame.corrections.gain_maps[0].row_pitch, 1);
  EXPECT_EQ(frame.corrections.gain_maps[0].gain, fields.gain);
}

TEST(DngOpcodes, AMapOfDemosaicedDataPerColourBecomesOneForEachSite) {
  MapFields fields;
  fields.planes = 3, fields.row_pitch = fields.column_pitch = 1, fields.map_planes = 3;
  fields.points_v = fields.points_h = 1;
  fields.gain = {1.25F, 1.5F, 1.75F};  // R, G, B
  fields.top = 3;
  DngBuilder dng = with(list3, {gain_map(fields)});
  dng.phase = BayerPhase::grbg;
  const RawFrame frame = read_built(dng);
  ASSERT_EQ(frame.corrections.gain_maps.size(), 4u);
  for (const GainMap& map : frame.corrections.gain_maps) {
    EXPECT_EQ(map.row_pitch, 2);
    EXPECT_EQ(map.column_pitch, 2);
    EXPECT_GE(map.top, 3);
    EXPECT_LE(map.top, 4);
    const auto colour = static_cast<std::size_t>(colour_at(BayerPhase::grbg, map.left, map.top));
    EXPECT_EQ(map.gain, std::vector<float>{fields.gain[colour]});
  }
}

TEST(DngOpcodes, AMapForOneColourOfDemosaicedDataTouchesItsSitesOnly) {
  MapFields fields;
  fields.plane = 2, fields.planes = 1, fields.row_pitch = fields.column_pitch = 1;
  const RawFrame frame = read_built(with(list3, {gain_map(fields)}));
  ASSERT_EQ(frame.corrections.gain_maps.size(), 1u);
  EXPECT_EQ(frame.corrections.gain_maps[0].top, 1);
  EXPECT_EQ(frame.corrections.gain_maps[0].left, 1);
}

TEST(DngOpcodes, AVignetteIsKept) {
  const RawFrame frame = read_built(with(list3, {vignette({0.1, 0.2, 0.3, 0.4, 0.5, 0.45, 0.55})}));
  ASSERT_EQ(frame.corrections.radial_gains.size(), 1u);
  const RadialGain& radial = frame.corrections.radial_gains[0];
  EXPECT_EQ(radial.k[0], 0.1);
  EXPECT_EQ(radial.k[4], 0.5);
  EXPECT_EQ(radial.centre_x, 0.45);
  EXPECT_EQ(radial.centre_y, 0.55);
}

TEST(DngOpcodes, DefectListsCountFromTheReadoutInList1AndFromTheActiveAreaInList2) {
  // Phase, one point (row 7, column 9), one rectangle (top 4, left 5, bottom 6, right 8).
  const Opcode defects = words(5, {0, 1, 1, 7, 9, 4, 5, 6, 8});
  for (const std::uint16_t list : {list1, list2}) {
    DngBuilder dng = with(list, {defects});
    dng.width = dng.height = 40;
    dng.set(50829, Tag::numbers(TagType::u32, {5, 4, 40, 40}));
    const auto found = read_built(dng).corrections.defects;
    ASSERT_EQ(found.size(), 2u);
    const int dx = list == list1 ? 4 : 0, dy = list == list1 ? 5 : 0;
    EXPECT_EQ(found[0].x, 9 - dx);
    EXPECT_EQ(found[0].y, 7 - dy);
    EXPECT_EQ(found[0].width * found[0].height, 1);
    EXPECT_EQ(found[1].x, 5 - dx);
    EXPECT_EQ(found[1].y, list == list1 ? 0 : 4) << "the row outside of the active area is cut off";
    EXPECT_EQ(found[1].width, 3);
    EXPECT_EQ(found[1].height, list == list1 ? 1 : 2);
  }
}

TEST(DngOpcodes, DefectsOutsideOfTheActiveAreaAreLeftOut) {
  const RawFrame frame = read_built(with(list2, {words(5, {0, 2, 0, 24, 0, 4294967295U, 4294967295U})}));
  EXPECT_TRUE(frame.corrections.defects.empty());
}

TEST(DngOpcodes, PixelsOfTheConstantAreFoundInTheReadout) {
  DngBuilder dng = with(list1, {words(4, {777, 0})});
  dng.width = dng.height = 30;
  dng.pixels = std::vector<std::uint16_t>(900, 500);
  dng.pixels[10 * 30 + 7] = 777;
  dng.pixels[0] = 777;  // outside of the active area
  dng.set(50829, Tag::numbers(TagType::u32, {2, 3, 30, 30}));
  const auto found = read_built(dng).corrections.defects;
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].x, 4);
  EXPECT_EQ(found[0].y, 8);
}

TEST(DngOpcodes, AConstantIsSearchedBeforeALinearizationTable) {
  DngBuilder dng = with(list1, {words(4, {3, 0})});
  dng.bits = 8;
  dng.pixels.assign(std::size_t{24} * 24, 9);
  dng.pixels[2 * 24 + 7] = 3;
  std::vector<double> table(256);
  for (int i = 0; i < 256; ++i) table[i] = i < 10 ? 3 : i * 4;
  dng.set(50712, Tag::numbers(TagType::u16, table));
  dng.set(50717, Tag::numbers(TagType::u16, {1020}));
  const RawFrame frame = read_built(dng);
  EXPECT_EQ(frame.raw.dn.at(7, 2), 3);
  EXPECT_EQ(frame.raw.dn.at(8, 2), 3);
  ASSERT_EQ(frame.corrections.defects.size(), 1u);
  EXPECT_EQ(frame.corrections.defects[0].x, 7);
  EXPECT_EQ(frame.corrections.defects[0].y, 2);
  EXPECT_TRUE(frame.warnings.empty());
}

Opcode polynomial(std::uint32_t plane, const std::vector<double>& coefficients, std::uint32_t pitch = 1) {
  Opcode out = words(8, {0, 0, 24, 24, plane, 1, pitch, pitch, static_cast<std::uint32_t>(coefficients.size() - 1)});
  for (const double k : coefficients) append_f64(out.parameters, k);
  return out;
}

/// Deltas of the rows of an area.
Opcode deltas(const std::vector<std::uint32_t>& area, const std::vector<float>& values) {
  Opcode out = words(10, area);
  append_u32(out.parameters, static_cast<std::uint32_t>(values.size()));
  for (const float value : values) append_f32(out.parameters, value);
  return out;
}

const std::vector<std::uint32_t> everywhere{0, 0, 24, 24, 0, 1, 1, 1};

bool same(const DngOpcode& a, const Opcode& b) {
  return a.id == b.id && a.version == b.version && a.flags == b.flags && a.parameters == b.parameters;
}

TEST(DngOpcodes, WhatIsNotAppliedIsNamedAndKept) {
  Opcode later = words(14, {7});
  later.version = 0x01080000, later.flags = 2;
  Opcode unknown = words(99, {1, 2});
  unknown.flags = 0;
  const std::vector<Opcode> third{words(1, std::vector<std::uint32_t>(14, 0)), words(2, {}), unknown,
                                  deltas(everywhere, std::vector<float>(24, 0.01F)), polynomial(0, {0, 1})};
  MapFields absent;
  absent.plane = 1;
  MapFields outside;
  outside.top = 30, outside.bottom = 40;
  const std::vector<Opcode> second{words(4, {777, 0}),       gain_map(absent),
                                   gain_map(outside),        later,
                                   words(6, {0, 0, 24, 24}), vignette({0.1, 0, 0, 0, 0, 0.5, 0.5})};
  DngBuilder dng = with(list3, third);
  dng.set(list2, opcode_list(second));
  dng.set(list1, opcode_list({words(6, {0, 0, 24, 24}), words(99, {})}));
  const RawFrame frame = read_built(dng);
  const std::vector<std::string> expected = {
      "TrimBounds (OpcodeList1) is not applied: it would move the active area",
      "opcode 99 (OpcodeList1) is not applied",
      "FixBadPixelsConstant (OpcodeList2) is not applied: its constant does not refer to the decoded values",
      "GainMap (OpcodeList2) is not applied: the image has no colour of its number",
      "GainMap (OpcodeList2) is not applied: its area is outside of the image",
      "WarpRectilinear2 (OpcodeList2) is not applied: it came with DNG 1.8",
      "TrimBounds (OpcodeList2) is not applied: other opcodes follow it",
      "FixVignetteRadial (OpcodeList2) is not applied: it follows TrimBounds",
      "WarpRectilinear (OpcodeList3) is not applied: it follows TrimBounds",
      "WarpFisheye (OpcodeList3) is not applied: it follows TrimBounds",
      "opcode 99 (OpcodeList3) is not applied: it follows TrimBounds",
      "DeltaPerRow (OpcodeList3) is not applied: it follows TrimBounds",
      "MapPolynomial (OpcodeList3) is not applied: it follows TrimBounds"};
  EXPECT_EQ(frame.warnings, expected);
  // A constant refers to codes that no other file has, and so does list 1.
  const std::vector<Opcode> kept(second.begin() + 1, second.end());
  EXPECT_TRUE(std::ranges::equal(frame.corrections.not_applied[0], kept, same));
  EXPECT_TRUE(std::ranges::equal(frame.corrections.not_applied[1], third, same));

  const std::vector<std::string> demosaiced = {
      "WarpRectilinear (OpcodeList3) is not applied", "WarpFisheye (OpcodeList3) is not applied",
      "opcode 99 (OpcodeList3) is not applied",
      "DeltaPerRow (OpcodeList3) is not applied: it is meant for demosaiced data",
      "MapPolynomial (OpcodeList3) is not applied: it is meant for demosaiced data"};
  EXPECT_EQ(read_built(with(list3, third)).warnings, demosaiced);
}

/// A damaged list is ignored as a whole, whatever sound opcodes it has: nothing of it is left in the frame.
void expect_damage(const DngBuilder& dng, const std::string& warning) {
  EXPECT_EQ(warned(dng), warning + "; the tag is ignored");
  const RawCorrections corrections = read_built(dng).corrections;
  EXPECT_TRUE(corrections.gain_maps.empty() && corrections.radial_gains.empty() && corrections.defects.empty());
  EXPECT_TRUE(corrections.not_applied[0].empty() && corrections.not_applied[1].empty());
}

TEST(DngOpcodes, ALastTrimBoundsIsTheDefaultCrop) {
  for (const std::uint16_t list : {list2, list3}) {
    DngBuilder dng = with(list, {vignette({0.1, 0, 0, 0, 0, 0.5, 0.5}), words(6, {3, 2, 20, 23})});
    dng.set(50719, Tag::numbers(TagType::u16, {0, 0}));
    dng.set(50720, Tag::numbers(TagType::u16, {24, 24}));
    const RawFrame frame = read_built(dng);
    EXPECT_TRUE(frame.warnings.empty());
    EXPECT_EQ(frame.raw.default_crop, (Rect{2, 3, 21, 17}));
    dng.set(50719, Tag::numbers(TagType::u16, {1, 2}));
    dng.set(50720, Tag::numbers(TagType::u16, {8, 9}));
    EXPECT_EQ(read_built(dng).raw.default_crop, (Rect{3, 5, 8, 9})) << "it counts from the trimmed corner";
  }
  expect_damage(with(list2, {words(6, {3, 2, 25, 23})}), "TrimBounds of the tag OpcodeList2 is damaged");
}

TEST(DngOpcodes, AnEmptyAreaIsTheWholeImage) {
  MapFields fields;
  fields.top = fields.left = fields.bottom = fields.right = 0;
  fields.row_pitch = fields.column_pitch = 1;
  const RawFrame frame = read_built(with(list2, {gain_map(fields)}));
  ASSERT_EQ(frame.corrections.gain_maps.size(), 1u);
  EXPECT_EQ(frame.corrections.gain_maps[0].bottom, 24);
  EXPECT_EQ(frame.corrections.gain_maps[0].right, 24);
}

TEST(DngOpcodes, APlaneOfAMapIsThatOfTheImage) {
  MapFields fields;
  fields.plane = 1, fields.planes = 2, fields.map_planes = 2;
  fields.points_v = fields.points_h = 1, fields.row_pitch = fields.column_pitch = 1;
  fields.gain = {1.25F, 1.5F};  // of plane 0, and of all further ones
  DngBuilder dng = with(list3, {gain_map(fields)});
  dng.phase = BayerPhase::rggb;
  const RawFrame frame = read_built(dng);
  ASSERT_EQ(frame.corrections.gain_maps.size(), 3u) << "two green sites and a blue one";
  for (const GainMap& map : frame.corrections.gain_maps) EXPECT_EQ(map.gain, std::vector<float>{1.5F});
}

TEST(DngOpcodes, FlagsAndVersionsUpToTheKnownDoNotMatter) {
  for (const std::uint32_t flags : {0U, 1U, 2U, 3U}) {
    for (const std::uint32_t version : {0U, 0x01030000U, 0x01060000U, 0x01070100U}) {
      for (Opcode opcode : {gain_map({}), deltas(everywhere, std::vector<float>(24, 0.01F))}) {
        opcode.flags = flags, opcode.version = version;
        const RawFrame frame = read_built(with(list2, {opcode}));
        EXPECT_TRUE(frame.warnings.empty());
        EXPECT_EQ(frame.corrections.gain_maps.size() + static_cast<std::size_t>(frame.raw.black_tag->at(0, 0) < 64),
                  1u);
      }
    }
  }
}

TEST(DngOpcodes, ValuesThatNoOpcodeHasAreDamage) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> rows(24, 0.01F);
  rows[7] = nan;
  const std::string of_list2 = " of the tag OpcodeList2 is damaged";
  expect_damage(with(list2, {deltas(everywhere, rows)}), "DeltaPerRow" + of_list2);
  rows[7] = 1.5F;
  expect_damage(with(list2, {deltas(everywhere, rows)}), "DeltaPerRow" + of_list2);
  rows.resize(23);
  expect_damage(with(list2, {deltas(everywhere, rows)}), "DeltaPerRow" + of_list2);
  expect_damage(with(list2, {polynomial(0, {0, 1}, 0)}), "MapPolynomial" + of_list2);
  expect_damage(with(list2, {polynomial(0, {0, nan})}), "MapPolynomial" + of_list2);
  expect_damage(with(list2, {polynomial(0, std::vector<double>(10, 0.1))}), "MapPolynomial" + of_list2);
  expect_damage(with(list2, {polynomial(0, {0, 1e300})}), "MapPolynomial" + of_list2);
  expect_damage(with(list2, {polynomial(0, {1, -1})}), "MapPolynomial" + of_list2 + ": its values fall");
  expect_damage(with(list2, {words(7, {0, 0, 24, 24, 0, 1, 1, 1, 0})}), "MapTable" + of_list2);
  expect_damage(with(list2, {words(7, {0, 0, 24, 24, 0, 1, 1, 1, 65537, 0})}), "MapTable" + of_list2);
  expect_damage(with(list2, {words(7, {0, 0, 24, 24, 0, 1, 1, 1, 2, 0x00090008})}),
                "MapTable" + of_list2 + ": its values fall");
  expect_damage(with(list2, {deltas(everywhere, std::vector<float>(24, -1.0F)), words(4, {1, 0})}),
                "the tag OpcodeList2 cannot be applied: its deltas raise black above white");
  DngBuilder without_black = with(list2, {polynomial(0, {0, 1})});
  expect_damage(without_black.remove(50714),
                "the tag OpcodeList2 cannot be applied: the file states no black level, from which its values count");
}

TEST(DngOpcodes, ASampleHasAtMost128FunctionsOfAList) {
  std::vector<Opcode> list(15, vignette({0.1, 0, 0, 0, 0, 0.5, 0.5}));
  list.resize(15 + 8, deltas(everywhere, std::vector<float>(24, 0.001F)));
  EXPECT_TRUE(read_built(with(list2, list)).warnings.empty());
  list.push_back(list.back());
  expect_damage(with(list2, list), "the tag OpcodeList2 asks for more changes than any camera writes");
}

TEST(DngOpcodes, DeltasOfWholeRowsAreThoseOfBlackLevelDeltaV) {
  DngBuilder dng;
  dng.set(50716, Tag::numbers(TagType::srational, std::vector<double>(24, 0.5)));
  dng.set(50717, Tag::numbers(TagType::u16, {1064}));
  std::vector<float> rows;
  for (int y = 0; y < 24; ++y) rows.push_back(0.001F * static_cast<float>(y));
  const RawFrame frame = read_built(dng.set(list2, opcode_list({deltas(everywhere, rows)})));
  EXPECT_EQ(frame.raw.black_tag->pattern_dn, std::vector<double>{64});
  for (int y = 0; y < 24; ++y) EXPECT_NEAR(frame.raw.black_tag->row_dn[y], 0.5 - 999.5 * 0.001 * y, 1e-5);
}

TEST(DngOpcodes, DeltasOfTooManySitesAreNotApplied) {
  DngBuilder dng;
  dng.width = dng.height = 8200;
  dng.pixels.assign(std::size_t{8200} * 8200, 500);
  std::vector<std::uint32_t> area{0, 1, 8200, 8199, 0, 1, 1, 1};
  dng.set(list2, opcode_list({deltas(area, std::vector<float>(8200, 0.01F))}));
  EXPECT_EQ(warned(dng),
            "the tag OpcodeList2 cannot be applied: it has a delta for too many pixels; the tag is ignored");
  area = {0, 0, 8200, 8200, 0, 1, 1, 2};
  dng.set(list2, opcode_list({deltas(area, std::vector<float>(8200, 0.01F))}));
  const RawFrame frame = read_built(dng);
  EXPECT_TRUE(frame.warnings.empty());
  EXPECT_EQ(frame.raw.black_tag->pattern_dn.size(), 2u * 8200) << "columns repeat";
}

TEST(DngOpcodes, ListsThatClaimMoreThanTheyHoldAreIgnored) {
  Bytes claims;
  append_u32(claims, 0xFFFFFFFF);
  DngBuilder count;
  count.set(list2, Tag::opaque(claims));
  expect_damage(count, "the tag OpcodeList2 is damaged");

  Bytes longer;
  for (const std::uint32_t word : {1U, 9U, 0U, 0U, 0xFFFFFFF0U, 1U}) append_u32(longer, word);
  DngBuilder size;
  size.set(list2, Tag::opaque(longer));
  expect_damage(size, "the tag OpcodeList2 is damaged");

  MapFields points;
  points.points_v = points.points_h = 0x7FFFFFFF;
  const Opcode sound = vignette({0.1, 0, 0, 0, 0, 0.5, 0.5});
  expect_damage(with(list2, {sound, gain_map(points)}), "GainMap of the tag OpcodeList2 is damaged");
  expect_damage(with(list1, {words(5, {0, 1, 0, 7, 9}), words(5, {0, 0xFFFFFFFF, 0xFFFFFFFF, 1, 1})}),
                "FixBadPixelsList of the tag OpcodeList1 is damaged");
  expect_damage(with(list3, {vignette({0, 0, 0})}), "FixVignetteRadial of the tag OpcodeList3 is damaged");
  expect_damage(with(list1, {words(4, {})}), "FixBadPixelsConstant of the tag OpcodeList1 is damaged");
}

TEST(DngOpcodes, MapsThatCannotBeEvaluatedAreIgnored) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  MapFields gain;
  gain.gain[2] = nan;
  MapFields pitch;
  pitch.row_pitch = 0;
  MapFields empty;
  empty.points_h = 0;
  MapFields spacing;
  spacing.spacing_h = 0;
  MapFields origin;
  origin.origin_v = std::numeric_limits<double>::infinity();
  MapFields negative;
  negative.gain[0] = -1;
  for (const MapFields& fields : {gain, pitch, empty, spacing, origin, negative}) {
    expect_damage(with(list2, {gain_map(fields)}), "GainMap of the tag OpcodeList2 is damaged");
  }
  expect_damage(with(list2, {vignette({nan, 0, 0, 0, 0, 0.5, 0.5})}),
                "FixVignetteRadial of the tag OpcodeList2 is damaged");
}

TEST(DngOpcodes, AListHolds64OpcodesAndTheFrame64Gains) {
  const std::vector<Opcode> most(64, words(5, {0, 1, 0, 7, 9}));
  EXPECT_EQ(read_built(with(list2, most)).corrections.defects.size(), 64u);
  std::vector<Opcode> more = most;
  more.push_back(most.front());
  expect_damage(with(list2, more), "the tag OpcodeList2 holds more opcodes than any camera writes");

  DngBuilder gains = with(list2, std::vector<Opcode>(64, vignette({0.1, 0, 0, 0, 0, 0.5, 0.5})));
  EXPECT_EQ(read_built(gains).corrections.radial_gains.size(), 64u);
  EXPECT_EQ(read_built(with(list2, std::vector<Opcode>(64, gain_map({})))).corrections.gain_maps.size(), 64u);
  gains.set(list3, opcode_list({gain_map({})}));
  EXPECT_EQ(warned(gains), "the tag OpcodeList3 asks for more gain maps than any camera writes; the tag is ignored");
}

TEST(DngOpcodes, DefectsOfAllListsTogetherAreLimited) {
  // 2^20 points are the most; each list here names half of them and one.
  std::vector<std::uint32_t> half{0, (1U << 19) + 1, 0};
  half.resize(half.size() + 2 * ((std::size_t{1} << 19) + 1));
  DngBuilder dng = with(list1, {words(5, half)});
  dng.set(list2, opcode_list({words(5, half)}));
  EXPECT_EQ(warned(dng), "the tag OpcodeList2 names more than a million defects; the tag is ignored");
  EXPECT_EQ(read_built(dng).corrections.defects.size(), half[1]);
}

DngBuilder megapixel(std::vector<Opcode> opcodes) {
  DngBuilder dng = with(list1, opcodes);
  dng.width = dng.height = 1024;
  dng.pixels = std::vector<std::uint16_t>(std::size_t{1} << 20, 500);
  return dng;
}

TEST(DngOpcodes, ABombOfConstantsTakesNoMoreMemoryThanOne) {
  const std::vector<std::byte> bomb = megapixel(std::vector<Opcode>(64, words(4, {500, 0}))).build();
  const std::int64_t before = peak_bytes([] {});
  const std::int64_t peak = peak_bytes([&] { EXPECT_TRUE(read_bytes(bomb)); });
  // 2^16 defects, at which the search ends, take 1 MiB, and twice as much while their list grows; the file, the frame
  // and the decoder's samples take 2 MiB each. All pixels, once for each opcode, would take 1 GiB.
  EXPECT_LT(peak - before, std::int64_t{32} << 20);
  EXPECT_TRUE(read_bytes(bomb)->corrections.defects.empty());
}

// 24 x 24 pixels: 36 are a sixteenth.
TEST(DngOpcodes, AConstantOfTooManyPixelsIsDroppedAndTheListIsKept) {
  DngBuilder dng = with(list1, {words(5, {0, 2, 0, 3, 4, 5, 6}), words(4, {777, 0})});
  dng.pixels = std::vector<std::uint16_t>(24 * 24, 500);
  std::fill_n(dng.pixels.begin(), 36, 777);
  EXPECT_EQ(read_built(dng).corrections.defects.size(), 2u + 36u);
  dng.pixels[36] = 777;
  EXPECT_EQ(read_built(dng).corrections.defects.size(), 2u);
  EXPECT_EQ(warned(dng), "FixBadPixelsConstant (OpcodeList1) is not applied: more than 36 pixels have its value");
}

TEST(DngOpcodes, PixelsOfSeveralConstantsAreAllFound) {
  DngBuilder dng = with(list1, {words(4, {777, 0}), words(4, {65536 + 500, 0}), words(4, {778, 0})});
  dng.pixels = std::vector<std::uint16_t>(24 * 24, 500);
  dng.pixels[7] = 777;
  dng.pixels[30] = 778;
  EXPECT_EQ(read_built(dng).corrections.defects.size(), 2u);
}

}  // namespace
}  // namespace lowlux::test
