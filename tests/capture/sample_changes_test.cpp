// Opcodes that change values, of OpcodeList1 and 2, against functions of the test's own applied one after the other.
#include "capture/dng/sample_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/capture/read_built.h"
#include "tests/support/dng/drawn_opcodes.h"
#include "tests/support/dng/float_dng.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::DrawnOpcode;
using test::OpcodeImage;
using test::Tag;
using test::TagType;

constexpr int files = 60;

Tag list_of(const std::vector<DrawnOpcode>& opcodes) {
  std::vector<test::Opcode> encoded;
  for (const DrawnOpcode& opcode : opcodes) encoded.push_back(opcode.encoded);
  return test::opcode_list(encoded);
}

std::vector<DrawnOpcode> draw_opcodes(const std::vector<std::uint32_t>& ids, const OpcodeImage& image,
                                      std::mt19937& draw) {
  std::vector<DrawnOpcode> out;
  for (int i = 1 + static_cast<int>(draw() % 5); i > 0; --i) {
    out.push_back(test::draw_opcode(ids[draw() % ids.size()], image, draw));
  }
  return out;
}

/// A mosaic, monochrome or an image of three colours with an active area, whose codes are drawn from 0 or `least` on.
DngBuilder draw_dng(int least, int most, std::mt19937& draw) {
  DngBuilder dng;
  const unsigned layout = draw() % 3;
  dng.monochrome = layout == 1;
  dng.samples = layout == 2 ? 3 : 1;
  dng.phase = static_cast<BayerPhase>(draw() % 4);
  dng.width = 30 + static_cast<int>(draw() % 20), dng.height = 30 + static_cast<int>(draw() % 20);
  if (dng.samples == 3) least += 1500;  // whose maps keep no values below black
  for (int i = 0; i < dng.width * dng.height * dng.samples; ++i) {
    dng.pixels.push_back(
        static_cast<std::uint16_t>(least + static_cast<int>(draw() % static_cast<unsigned>(most - least))));
  }
  return dng;
}

Rect set_active(DngBuilder& dng, std::mt19937& draw) {
  const Rect active{static_cast<int>(draw() % 5), static_cast<int>(draw() % 5), dng.width - 6, dng.height - 5};
  dng.set(50829, Tag::numbers(TagType::u32, {1.0 * active.y, 1.0 * active.x, 1.0 * active.y + active.height,
                                             1.0 * active.x + active.width}));
  return active;
}

TEST(SampleChanges, OfListOneAreMadeToStoredCodesBeforeTheLinearizationTable) {
  for (int i = 0; i < files; ++i) {
    const unsigned seed = 20261129 + static_cast<unsigned>(i);
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 draw(seed);
    DngBuilder dng = draw_dng(0, 65536, draw);
    set_active(dng, draw);
    const OpcodeImage image{.list = 1, .width = dng.width, .height = dng.height, .planes = dng.samples};
    const auto opcodes = draw_opcodes({7, 8, 10, 11, 12, 13}, image, draw);
    dng.set(test::opcode_list1, list_of(opcodes));
    dng.storage = draw() % 2 == 0 && dng.samples == 1 && dng.width % 2 == 0 && !dng.monochrome
                      ? test::DngStorage::lossless_jpeg
                      : test::DngStorage::uncompressed;
    const bool has_table = draw() % 2 == 0;
    if (has_table) {
      std::vector<double> table;
      for (int code = 0; code < 65536; ++code) table.push_back(65535 - code);
      dng.set(50712, Tag::numbers(TagType::u16, table));
    }
    const RawFrame frame = test::read_built(dng);
    EXPECT_TRUE(frame.warnings.empty()) << frame.warnings.front();
    ASSERT_EQ(frame.raw.dn.size(), dng.pixels.size());
    for (int at = 0; at < static_cast<int>(dng.pixels.size()); ++at) {
      const int plane = at % dng.samples, x = at / dng.samples % dng.width, y = at / dng.samples / dng.width;
      double code = dng.pixels[static_cast<std::size_t>(at)];
      for (const DrawnOpcode& opcode : opcodes) {
        code = std::round(std::clamp(opcode.truth(code, x, y, plane), 0.0, 65535.0));
      }
      ASSERT_EQ(frame.raw.dn.data()[at], has_table ? 65535 - code : code) << x << ", " << y << ", plane " << plane;
    }
  }
}

TEST(SampleChanges, GainsOfListOneMultiplyCodes) {
  for (int i = 0; i < files; ++i) {
    std::mt19937 draw(static_cast<unsigned>(i));
    DngBuilder dng = draw_dng(100, 50000, draw);
    set_active(dng, draw);
    const OpcodeImage image{.list = 1, .width = dng.width, .height = dng.height, .planes = dng.samples};
    const DrawnOpcode gain = test::draw_opcode(i % 2 == 0 ? 9 : 3, image, draw);
    dng.set(test::opcode_list1, list_of({gain}));
    const RawFrame frame = test::read_built(dng);
    EXPECT_TRUE(frame.warnings.empty());
    for (int at = 0; at < static_cast<int>(dng.pixels.size()); ++at) {
      const int plane = at % dng.samples, x = at / dng.samples % dng.width, y = at / dng.samples / dng.width;
      const double code = gain.truth(dng.pixels[static_cast<std::size_t>(at)], x, y, plane);
      // Rounding to codes, and gains as floats.
      ASSERT_NEAR(frame.raw.dn.data()[at], std::min(code, 65535.0), 0.5 + 2e-7 * code) << i << ": " << x << ", " << y;
    }
  }
}

/// The product of all gains of the frame at a pixel, evaluated as DNG defines them.
double gain_of(const RawFrame& frame, int x, int y, int plane) {
  double product = 1;
  const Rect& active = frame.raw.active;
  for (const GainMap& map : frame.corrections.gain_maps) {
    const bool inside = x >= map.left && x < map.right && (x - map.left) % map.column_pitch == 0 && y >= map.top &&
                        y < map.bottom && (y - map.top) % map.row_pitch == 0 && plane >= map.first_plane &&
                        plane - map.first_plane < map.planes;
    if (!inside) continue;
    const auto place = [](double relative, double origin, double spacing, int points) {
      return std::clamp((relative - origin) / spacing, 0.0, points - 1.0);
    };
    const double row = place((y + 0.5) / active.height, map.origin_v, map.spacing_v, map.points_v);
    const double column = place((x + 0.5) / active.width, map.origin_h, map.spacing_h, map.points_h);
    double gain = 0;
    for (int i = 0; i < map.points_v; ++i) {
      for (int j = 0; j < map.points_h; ++j) {
        const double weight = std::max(0.0, 1 - std::fabs(row - i)) * std::max(0.0, 1 - std::fabs(column - j));
        gain += weight * static_cast<double>(map.gain[static_cast<std::size_t>((i * map.points_h + j) * map.map_planes +
                                                                               std::min(plane, map.map_planes - 1))]);
      }
    }
    product *= gain;
  }
  for (const RadialGain& radial : frame.corrections.radial_gains) {
    const double w = active.width - 1, h = active.height - 1, cx = radial.centre_x, cy = radial.centre_y;
    const double r =
        std::hypot(x - cx * w, y - cy * h) / std::hypot(std::max(cx, 1 - cx) * w, std::max(cy, 1 - cy) * h);
    double gain = 1;
    for (int i = 0; i < 5; ++i) gain += radial.k[i] * std::pow(r, 2 * i + 2);
    product *= gain;
  }
  return product;
}

/// The value of a pixel as the pipeline has it: above black, relative to white, after all gains.
double value_of(const RawFrame& frame, double range_dn, int x, int y, int plane, int planes) {
  const RawDn& raw = frame.raw;
  const int column = (raw.active.x + x) * planes + plane, row = raw.active.y + y;
  const double dn = raw.is_float() ? static_cast<double>(raw.dn_float.at(column, row)) : raw.dn.at(column, row);
  return gain_of(frame, x, y, plane) * (dn - raw.black_tag->at(x, y, plane)) / range_dn;
}

TEST(SampleChanges, OfListTwoAreMadeToFractionsOfWhiteInTheirOrder) {
  constexpr double white = 15000;
  const std::vector<std::uint32_t> ids{3, 7, 8, 9, 10, 11, 12, 13};
  const std::vector<std::uint32_t> without_maps{3, 9, 10, 11, 12, 13};
  int with_maps = 0;
  for (int i = 0; i < 2 * files; ++i) {
    const unsigned seed = 7000 + static_cast<unsigned>(i);
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 draw(seed);
    DngBuilder dng = draw_dng(200, 10000, draw);
    const Rect active = set_active(dng, draw);
    // Codes of black noise, except in images of three colours, which have no black level after maps.
    std::vector<double> black{500, 510, 520, 530};
    if (dng.samples == 3) {
      black = {100};
    } else {
      dng.set(50713, Tag::numbers(TagType::u16, {2, 2}));
    }
    dng.set(50714, Tag::numbers(TagType::u16, black));
    dng.set(50717, Tag::numbers(TagType::u16, std::vector<double>(static_cast<std::size_t>(dng.samples), white)));
    const OpcodeImage image{.list = 2, .width = active.width, .height = active.height, .planes = dng.samples};
    const auto opcodes = draw_opcodes(i % 2 == 0 ? ids : without_maps, image, draw);
    dng.set(test::opcode_list2, list_of(opcodes));
    const RawFrame frame = test::read_built(dng);
    EXPECT_TRUE(frame.warnings.empty()) << frame.warnings.front();
    const bool maps = std::ranges::any_of(opcodes, &DrawnOpcode::is_map);
    with_maps += static_cast<int>(maps);
    const double mean_black = dng.samples == 3 ? 100 : 515;
    const double code = maps ? 65535 - frame.raw.black_tag->pattern_dn[0] : white - mean_black;
    ASSERT_FALSE(frame.raw.is_float());
    EXPECT_EQ(frame.raw.white_dn[0], maps ? 65535 : white);
    for (int y = 0; y < active.height; ++y) {
      for (int x = 0; x < active.width; ++x) {
        for (int plane = 0; plane < dng.samples; ++plane) {
          const std::size_t at =
              (static_cast<std::size_t>(active.y + y) * dng.width + active.x + x) * dng.samples + plane;
          const double black_dn = black[dng.samples == 3 ? 0 : static_cast<std::size_t>(2 * (y % 2) + x % 2)];
          double value = (dng.pixels[at] - black_dn) / (white - mean_black);
          for (const DrawnOpcode& opcode : opcodes) value = opcode.truth(value, x, y, plane);
          const double rounding = maps ? 0.5 / code * gain_of(frame, x, y, plane) : 0;
          // Gains and deltas are floats.
          ASSERT_NEAR(value_of(frame, code, x, y, plane, dng.samples), value, rounding + 1e-6) << x << ", " << y;
        }
      }
    }
  }
  EXPECT_GT(with_maps, files / 3);
}

TEST(SampleChanges, OfFloatingPointSamplesLeaveTheirLevels) {
  for (int i = 0; i < files; ++i) {
    std::mt19937 draw(400 + static_cast<unsigned>(i));
    std::uniform_real_distribution<float> light(-0.05F, 0.9F);
    Plane<float> mosaic(40, 30);
    std::generate_n(mosaic.data(), mosaic.size(), [&] { return light(draw); });
    DngBuilder dng = test::float_dng(mosaic, std::nullopt);
    const OpcodeImage image{.list = 2, .width = 40, .height = 30};
    const auto opcodes = draw_opcodes({7, 8, 9, 10, 11, 12}, image, draw);
    const RawFrame frame = test::read_built(dng.set(test::opcode_list2, list_of(opcodes)));
    EXPECT_TRUE(frame.warnings.empty());
    EXPECT_EQ(frame.raw.white_dn[0], 1);
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        double value = static_cast<double>(mosaic.at(x, y));
        for (const DrawnOpcode& opcode : opcodes) value = opcode.truth(value, x, y, 0);
        ASSERT_NEAR(value_of(frame, 1, x, y, 0, 1), value, 2e-6) << i << ": " << x << ", " << y;
      }
    }
  }
}

TEST(SampleChanges, SaturatedPixelsHaveNoDelta) {
  std::mt19937 draw(3);
  DngBuilder dng = draw_dng(100, 4000, draw);
  dng.samples = 1, dng.monochrome = false;
  dng.pixels.assign(static_cast<std::size_t>(dng.width) * dng.height, 4095);
  dng.set(50717, Tag::numbers(TagType::u16, {4095}));
  const auto opcode = test::draw_opcode(10, {.list = 2, .width = dng.width, .height = dng.height}, draw);
  const RawFrame frame = test::read_built(dng.set(test::opcode_list2, list_of({opcode})));
  EXPECT_EQ(frame.raw.dn.at(5, 5), frame.raw.white_dn[0]);
}

}  // namespace
}  // namespace lowlux::capture
