// DNGs in JPEG XL, encoded by libjxl: mosaics, monochrome and LinearRaw, in tiles and strips.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/capture/read_built.h"
#include "tests/support/dng/jpeg_xl.h"

namespace lowlux::capture {
namespace {

using test::DngBuilder;
using test::has;
using test::refused;
using test::Tag;
using test::TagType;

#ifdef LOWLUX_WITH_JPEG_XL
/// What is stored: the samples of the image as they stand in the file, cut into parts.
struct Stored {
  DngBuilder dng;
  Plane<std::uint16_t> codes;
};

struct Shape {
  int width = 50, height = 40, samples = 1, bits = 12, tile = 32;
  bool monochrome = false;
};

Plane<std::uint16_t> part_of(const Plane<std::uint16_t>& image, int samples, int left, int top, int width, int height) {
  Plane<std::uint16_t> out(width * samples, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width * samples; ++x) {
      const int u = std::min(left + x / samples, image.width() / samples - 1);
      out.at(x, y) = image.at(u * samples + x % samples, std::min(top + y, image.height() - 1));
    }
  }
  return out;
}

/// Returns random codes of all bits; `tile` 0 stores one strip.
Stored stored(const Shape& shape, unsigned seed, float distance = 0) {
  Stored out;
  out.codes = Plane<std::uint16_t>(shape.width * shape.samples, shape.height);
  std::mt19937 random(seed);
  for (int y = 0; y < shape.height; ++y) {
    for (int x = 0; x < out.codes.width(); ++x) {
      const int ramp = ((x / shape.samples + y) << shape.bits) / (shape.width + shape.height + 40);
      out.codes.at(x, y) = static_cast<std::uint16_t>(distance > 0 ? ramp : random() >> (32 - shape.bits));
    }
  }
  DngBuilder& dng = out.dng;
  dng.width = shape.width, dng.height = shape.height, dng.samples = shape.samples, dng.bits = shape.bits;
  dng.monochrome = shape.monochrome;
  const int side_x = shape.tile == 0 ? shape.width : shape.tile, side_y = shape.tile == 0 ? shape.height : shape.tile;
  dng.parts_are_tiles = shape.tile != 0;
  if (shape.tile != 0) dng.tile_width = dng.tile_height = shape.tile;
  for (int top = 0; top < shape.height; top += side_y) {
    for (int left = 0; left < shape.width; left += side_x) {
      dng.stored_parts.push_back(test::jpeg_xl_of(part_of(out.codes, shape.samples, left, top, side_x, side_y),
                                                  shape.samples, shape.bits, distance));
    }
  }
  dng.set(259, Tag::numbers(TagType::u16, {52546}));
  return out;
}

TEST(JpegXlDng, CodesWithoutLossAreThoseStored) {
  unsigned seed = 1;
  for (const int bits : {8, 10, 12, 14, 16}) {
    for (const Shape shape : {Shape{.bits = bits}, Shape{.width = 23, .height = 65, .bits = bits, .tile = 0},
                              Shape{.samples = 3, .bits = bits}, Shape{.bits = bits, .monochrome = true}}) {
      SCOPED_TRACE("seed " + std::to_string(++seed) + ", " + std::to_string(bits) + " bits");
      const Stored in = stored(shape, seed);
      const RawFrame frame = test::read_built(in.dng);
      EXPECT_TRUE(frame.warnings.empty()) << frame.warnings.front();
      ASSERT_EQ(frame.raw.dn.width(), in.codes.width());
      ASSERT_TRUE(std::equal(in.codes.data(), in.codes.data() + in.codes.size(), frame.raw.dn.data()));
    }
  }
}

TEST(JpegXlDng, LossIsThatOfTheDistance) {
  const Stored in = stored({.samples = 3, .bits = 16}, 3, 0.5F);
  const RawFrame frame = test::read_built(in.dng);
  double worst = 0;
  for (std::size_t i = 0; i < in.codes.size(); ++i) {
    worst = std::max(worst, std::fabs(frame.raw.dn.data()[i] - static_cast<double>(in.codes.data()[i])));
  }
  EXPECT_GT(worst, 0);
  EXPECT_LT(worst, 0.02 * 65535);
}

TEST(JpegXlDng, RowsAndColumnsStoredApartComeToTheirPlaces) {
  for (const auto& [rows, columns] : {std::pair{2, 2}, {2, 1}, {1, 3}, {7, 5}}) {
    Stored in = stored({.width = 51, .height = 43}, 9);
    in.dng.set(50975, Tag::numbers(TagType::u16, {static_cast<double>(rows)}));
    in.dng.set(52547, Tag::numbers(TagType::u16, {static_cast<double>(columns)}));
    const RawFrame frame = test::read_built(in.dng);
    // Row r of field f is row f + r * rows of the image; fields follow each other.
    int stored_y = 0;
    for (int f = 0; f < rows; ++f) {
      for (int y = f; y < 43; y += rows, ++stored_y) {
        int stored_x = 0;
        for (int g = 0; g < columns; ++g) {
          for (int x = g; x < 51; x += columns, ++stored_x) {
            ASSERT_EQ(frame.raw.dn.at(x, y), in.codes.at(stored_x, stored_y)) << x << ", " << y;
          }
        }
      }
    }
  }
}

TEST(JpegXlDng, ATableIsApplied) {
  Stored in = stored({.bits = 10}, 4);
  std::vector<double> table;
  table.reserve(1024);
  for (int i = 0; i < 1024; ++i) table.push_back(i < 512 ? i : 512 + 4 * (i - 512));
  in.dng.set(50712, Tag::numbers(TagType::u16, table));
  in.dng.set(50717, Tag::numbers(TagType::u16, {2556}));
  const RawFrame frame = test::read_built(in.dng);
  for (std::size_t i = 0; i < in.codes.size(); ++i) {
    ASSERT_EQ(frame.raw.dn.data()[i], table[in.codes.data()[i]]);
  }
}

TEST(JpegXlDng, WhatCannotBeDecodedIsRefusedWithTheReason) {
  const Stored good = stored({}, 2);
  const auto with_part = [&](std::vector<std::byte> part) {
    DngBuilder dng = good.dng;
    dng.stored_parts[3] = std::move(part);
    return refused(dng);
  };
  std::vector<std::byte> cut = good.dng.stored_parts[3];
  cut.resize(cut.size() / 2);
  EXPECT_TRUE(has(with_part(cut), "from column 32, row 32 on does not decode: it"));
  EXPECT_TRUE(has(with_part(std::vector<std::byte>(100)), "not JPEG XL"));
  EXPECT_TRUE(has(with_part(test::jpeg_xl_of(Plane<std::uint16_t>(16, 32), 1, 12)), "size of its tile"));
  EXPECT_TRUE(has(with_part(test::jpeg_xl_of(Plane<std::uint16_t>(96, 32), 3, 12)), "channels"));
  DngBuilder few = good.dng;
  few.stored_parts.pop_back();
  EXPECT_TRUE(has(refused(few), "needs 4 strips or tiles"));
  DngBuilder apart = good.dng;
  EXPECT_TRUE(has(refused(apart.set(50975, Tag::numbers(TagType::u16, {0}))), "RowInterleaveFactor"));
  EXPECT_TRUE(has(refused(apart.set(50975, Tag::numbers(TagType::u16, {41}))), "RowInterleaveFactor"));
  EXPECT_EQ(refused(good.dng, {.max_pixels = 1999}).code, ErrorCode::too_large);
}

TEST(JpegXlDng, FlippedBitsGiveAnErrorOrAFrameButNeverACrash) {
  const std::vector<std::byte> file = stored({.width = 30, .height = 30, .tile = 0}, 5).dng.build();
  std::mt19937 random(6);
  for (int i = 0; i < 60; ++i) {
    std::vector<std::byte> damaged = file;
    for (int flips = 0; flips < 3; ++flips) damaged[random() % file.size()] ^= std::byte{1} << random() % 8;
    const auto frame = test::read_bytes(damaged, {.max_decode_cpu_s = 5});
    if (!frame) {
      EXPECT_FALSE(has(frame.error(), "crashed")) << i << ": " << frame.error().message;
    }
  }
}
#else
TEST(JpegXlDng, WithoutLibjxlTheRefusalNamesIt) {
  DngBuilder dng;
  EXPECT_TRUE(has(refused(dng.set(259, Tag::numbers(TagType::u16, {52546}))), "libjxl"));
}
#endif

TEST(JpegXlDng, OtherImagesStoredApartAreRefused) {
  DngBuilder dng;
  EXPECT_TRUE(has(refused(dng.set(50975, Tag::numbers(TagType::u16, {2}))), "stored apart"));
}

}  // namespace
}  // namespace lowlux::capture
