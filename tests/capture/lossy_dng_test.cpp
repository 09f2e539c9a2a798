// Lossy DNGs: LinearRaw in baseline JPEG, with the curve that makes 8 bits suffice.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "capture/decoder/decoder_process.h"
#include "isp/codec/jpeg.h"
#include "tests/capture/read_built.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::has;
using test::refused;
using test::Tag;
using test::TagType;

constexpr int width = 50, height = 40, tile = 32;

/// Returns a smooth image, which differs between colours, as one JPEG of `w` x `h` from (left, top) on.
std::vector<std::byte> jpeg_tile(int left, int top, int w, int h) {
  Encoded8 picture{Plane<std::uint8_t>(3 * w, h)};
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const int u = std::min(left + x, width), v = std::min(top + y, height);
      const std::array<int, 3> rgb{5 * u, 6 * v, 2 * (u + v) + 20};
      for (int c = 0; c < 3; ++c) picture.codes.at(3 * x + c, y) = static_cast<std::uint8_t>(std::min(rgb[c], 255));
    }
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
  EXPECT_TRUE(isp::encode_jpeg(picture, {}, {.quality = 95}, file.get()));
  std::vector<std::byte> bytes(static_cast<std::size_t>(std::ftell(file.get())));
  std::rewind(file.get());
  EXPECT_EQ(std::fread(bytes.data(), 1, bytes.size(), file.get()), bytes.size());
  return bytes;
}

DngBuilder lossy_dng() {
  DngBuilder dng;
  dng.width = width, dng.height = height, dng.samples = 3, dng.bits = 8;
  dng.tile_width = dng.tile_height = tile;
  dng.parts_are_tiles = true;
  for (const int y : {0, tile}) {
    for (const int x : {0, tile}) dng.stored_parts.push_back(jpeg_tile(x, y, tile, tile));
  }
  dng.set(259, Tag::numbers(TagType::u16, {34892}));
  dng.set(50714, Tag::numbers(TagType::u16, {0, 0, 0}));
  dng.set(50717, Tag::numbers(TagType::u16, {255, 255, 255}));
  return dng;
}

struct PolynomialOpcode {
  std::uint32_t plane = 0, top = 0, bottom = height, pitch = 1;
  std::vector<double> coefficient;
};

Tag opcode_list(const std::vector<PolynomialOpcode>& opcodes) {
  test::ByteWriter out(true);
  out.number(opcodes.size(), 4);
  for (const PolynomialOpcode& o : opcodes) {
    for (const std::uint64_t word : {8ULL, 0x01030000ULL, 0ULL, 36ULL + 8 * o.coefficient.size()}) out.number(word, 4);
    for (const std::uint32_t word : {o.top, 0U, o.bottom, std::uint32_t{width}, o.plane, 1U, o.pitch, o.pitch}) {
      out.number(word, 4);
    }
    out.number(o.coefficient.size() - 1, 4);
    for (const double k : o.coefficient) out.number(std::bit_cast<std::uint64_t>(k), 8);
  }
  return Tag::opaque(out.out);
}

std::vector<PolynomialOpcode> curves() {
  return {{.plane = 0, .coefficient = {0, 0.1, 0.3, 0.6}},
          {.plane = 1, .coefficient = {0.01, 0.2, 0.7}},
          {.plane = 2, .coefficient = {0, 0, 1}}};
}

TEST(LossyDng, CodesWithoutACurveAreThoseOfTheJpeg) {
  const RawDn raw = test::read_built(lossy_dng()).raw;
  ASSERT_EQ(raw.dn.width(), 3 * width);
  EXPECT_EQ(raw.layout, SensorLayout::linear_rgb);
  EXPECT_EQ(raw.white_dn[0], 255);
  double worst = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) worst = std::max(worst, std::fabs(raw.dn.at(3 * x, y) - std::min(5.0 * x, 255.0)));
  }
  EXPECT_LE(worst, 8);  // [codes] what quality 95 loses of a ramp of 5 codes per pixel
}

TEST(LossyDng, TheCurveIsThatOfLibRaw) {
  DngBuilder dng = lossy_dng();
  dng.set(51009, opcode_list(curves()));
  const auto bytes = dng.build();
  const RawFrame frame = test::read_built(dng);
  const auto peer = decode_contained(bytes, {});
  ASSERT_TRUE(peer) << peer.error().message;
  EXPECT_TRUE(frame.warnings.empty()) << frame.warnings.front();
  EXPECT_EQ(frame.raw.white_dn[1], 65535);
  ASSERT_EQ(peer->samples.width(), frame.raw.dn.width());
  for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) {
    // LibRaw truncates where lowlux rounds.
    ASSERT_NEAR(frame.raw.dn.data()[i], peer->samples.data()[i], 1) << "sample " << i;
  }
}

TEST(LossyDng, ATableComesBeforeTheCurve) {
  DngBuilder dng = lossy_dng();
  const RawDn codes = test::read_built(dng).raw;
  std::vector<double> table;
  for (int i = 0; i < 200; ++i) table.push_back(10 + 5 * i);
  dng.set(50712, Tag::numbers(TagType::u16, table));
  dng.set(50714, Tag::numbers(TagType::u16, {10}));
  dng.set(50717, Tag::numbers(TagType::u16, {1000}));
  const RawDn linear = test::read_built(dng).raw;
  dng.set(51009, opcode_list(curves()));
  const RawDn curved = test::read_built(dng).raw;
  for (std::size_t i = 0; i < codes.dn.size(); ++i) {
    const double dn = table[std::min<std::size_t>(codes.dn.data()[i], 199)];
    ASSERT_EQ(linear.dn.data()[i], dn);
    const double x = std::clamp((dn - 10) / 990, 0.0, 1.0);
    const auto k = curves()[i % 3].coefficient;
    double y = 0;
    for (std::size_t n = 0; n < k.size(); ++n) y += k[n] * std::pow(x, static_cast<double>(n));
    ASSERT_NEAR(curved.dn.data()[i], 65535 * std::min(y, 1.0), 0.5 + 1e-9) << i;
  }
}

TEST(LossyDng, ACurveMayApplyToAPartOfTheImage) {
  DngBuilder dng = lossy_dng();
  const RawDn codes = test::read_built(dng).raw;
  std::vector<PolynomialOpcode> parts = curves();
  parts[0].top = 7, parts[0].bottom = 30, parts[1].pitch = 2, parts[2].pitch = 3;
  dng.set(51009, opcode_list(parts));
  const RawDn curved = test::read_built(dng).raw;
  for (int i = 0; i < static_cast<int>(codes.dn.size()); ++i) {
    const PolynomialOpcode& part = parts[static_cast<std::size_t>(i % 3)];
    const int x = i / 3 % width, y = i / 3 / width;
    const auto inside = [&](int at, std::uint32_t first) {
      return at >= static_cast<int>(first) && (at - static_cast<int>(first)) % static_cast<int>(part.pitch) == 0;
    };
    double value = codes.dn.data()[i] / 255.0;
    if (inside(y, part.top) && inside(x, 0) && y < static_cast<int>(part.bottom)) {
      double sum = 0;
      for (std::size_t n = 0; n < part.coefficient.size(); ++n) {
        sum += part.coefficient[n] * std::pow(value, static_cast<double>(n));
      }
      value = sum;
    }
    ASSERT_NEAR(curved.dn.data()[i], 65535 * value, 0.5 + 1e-9) << x << ", " << y;
  }
}

TEST(LossyDng, OneSampleIsMonochrome) {
  DngBuilder dng = lossy_dng();
  dng.samples = 1;
  dng.monochrome = true;
  dng.remove(50714).set(50717, Tag::numbers(TagType::u16, {255}));
  const RawDn raw = test::read_built(dng).raw;
  EXPECT_EQ(raw.layout, SensorLayout::monochrome);
  EXPECT_EQ(raw.dn.width(), width);
}

TEST(LossyDng, WhatCannotBeDecodedIsRefusedWithTheReason) {
  DngBuilder mosaic;
  mosaic.bits = 8;
  EXPECT_TRUE(has(refused(mosaic.set(259, Tag::numbers(TagType::u16, {34892}))), "LinearRaw images of 8 bits only"));
  const auto with = [](const std::vector<PolynomialOpcode>& opcodes) {
    DngBuilder dng = lossy_dng();
    return refused(dng.set(51009, opcode_list(opcodes)));
  };
  EXPECT_TRUE(has(with({{.coefficient = {1, -1}}}), "fall"));
  EXPECT_TRUE(has(with({{.coefficient = {0, std::nan("")}}}), "damaged"));
  EXPECT_TRUE(has(with({{.coefficient = std::vector<double>(10, 0.1)}}), "damaged"));
  DngBuilder cut = lossy_dng();
  cut.stored_parts[3].resize(cut.stored_parts[3].size() / 2);
  EXPECT_TRUE(has(refused(cut), "from column 32, row 32 on does not decode"));
  DngBuilder other = lossy_dng();
  other.stored_parts[1] = jpeg_tile(0, 0, 16, 32);
  EXPECT_TRUE(has(refused(other), "16 x 32 pixels, expected 32 x 32"));
  DngBuilder few = lossy_dng();
  few.stored_parts.pop_back();
  EXPECT_TRUE(has(refused(few), "needs 4 strips or tiles"));
}

}  // namespace
}  // namespace lowlux::capture
