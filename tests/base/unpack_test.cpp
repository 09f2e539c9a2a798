#include "isp/base/packed/raw_format.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <vector>

#include "tests/base/unpack_check.h"

namespace lowlux::unpack_test {
namespace {

using namespace unpack_testing;
using Row = std::vector<std::byte>;
using CodeRow = std::vector<std::uint16_t>;

CodeRow unpacked(const RawFormat& format, const Row& row, int width) {
  CodeRow codes(width);
  unpack_row(format, row.data(), width, codes.data());
  return codes;
}

Row bytes_of(std::initializer_list<int> values) {
  Row out;
  for (const int value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

/// Writes bits one after another, from the lowest or the highest of each byte on.
class BitWriter {
 public:
  explicit BitWriter(bool highest_first) : highest_first_(highest_first) {}

  void put(unsigned value, int bits) {
    for (int i = 0; i < bits; ++i) put_bit(value >> (highest_first_ ? bits - 1 - i : i) & 1U);
  }
  const Row& row() const { return row_; }

 private:
  void put_bit(unsigned bit) {
    if (place_ == 0) row_.push_back(std::byte{0});
    row_.back() |= static_cast<std::byte>(bit << (highest_first_ ? 7 - place_ : place_));
    place_ = (place_ + 1) % 8;
  }

  bool highest_first_;
  int place_ = 0;
  Row row_;
};

/// How a camera would send these codes, whole groups of them. Bits that mean nothing are ones.
Row packed(const RawFormat& format, const CodeRow& codes) {
  BitWriter writer(format.packing == RawPacking::big16 || format.packing == RawPacking::bits_msb_first);
  const auto group = static_cast<std::size_t>(group_of(format).pixels);
  for (std::size_t first = 0; first < codes.size(); first += group) {
    const auto each = [&](auto put) {
      for (std::size_t i = first; i < first + group; ++i) put(codes[i]);
    };
    switch (format.packing) {
      case RawPacking::byte:
        each([&](unsigned code) { writer.put(code, 8); });
        break;
      case RawPacking::little16:
      case RawPacking::big16:
        each([&](unsigned code) { writer.put(code, 16); });
        break;
      case RawPacking::csi2:
        each([&](unsigned code) { writer.put(code >> (format.bits - 8), 8); });
        each([&](unsigned code) { writer.put(code, format.bits - 8); });
        break;
      case RawPacking::ipu3:
        each([&](unsigned code) { writer.put(code, 10); });
        writer.put(0x3f, 6);
        break;
      case RawPacking::bits_msb_first:
        each([&](unsigned code) { writer.put(code, 10); });
        break;
    }
  }
  return writer.row();
}

RawFormat mono(int bits, RawPacking packing) { return {bits, packing, SensorLayout::monochrome, BayerPhase::rggb}; }

// Worked out by hand from the tables of the V4L2 documentation (pixfmt-srggb10p, -12p, -14p, pixfmt-y10b).
TEST(Unpack, TakesBytesAsThePublishedTablesHaveThem) {
  const CodeRow ten{0x3ff, 0x000, 0x201, 0x0a5};
  EXPECT_EQ(unpacked(mono(10, RawPacking::csi2), bytes_of({0xff, 0x00, 0x80, 0x29, 0x53}), 4), ten);
  EXPECT_EQ(unpacked(mono(10, RawPacking::bits_msb_first), bytes_of({0xff, 0xc0, 0x08, 0x04, 0xa5}), 4), ten);
  EXPECT_EQ(unpacked(mono(12, RawPacking::csi2), bytes_of({0x12, 0xab, 0xc3}), 2), (CodeRow{0x123, 0xabc}));
  EXPECT_EQ(unpacked(mono(14, RawPacking::csi2), bytes_of({0xff, 0x00, 0x80, 0x01, 0x3f, 0x18, 0xaf}), 4),
            (CodeRow{0x3fff, 0x0020, 0x2031, 0x006b}));
  EXPECT_EQ(unpacked(mono(8, RawPacking::byte), bytes_of({0, 1, 0x80, 0xff}), 4), (CodeRow{0, 1, 0x80, 0xff}));
  EXPECT_EQ(unpacked(mono(16, RawPacking::little16), bytes_of({0x34, 0x12, 0xff, 0}), 2), (CodeRow{0x1234, 0xff}));
  EXPECT_EQ(unpacked(mono(16, RawPacking::big16), bytes_of({0x12, 0x34, 0, 0xff}), 2), (CodeRow{0x1234, 0xff}));
}

TEST(Unpack, ReadsIpu3GroupsFromTheLowestBitOn) {
  const RawFormat format{10, RawPacking::ipu3, SensorLayout::bayer, BayerPhase::grbg};
  Row row(64, std::byte{0});
  row[0] = std::byte{0x01}, row[1] = std::byte{0x08};    // 1, then 2 from bit 10 on
  row[30] = std::byte{0xff}, row[31] = std::byte{0xff};  // the 25th: bits 240..249, and six that mean nothing
  row[32] = std::byte{0x55};
  const CodeRow codes = unpacked(format, row, 50);
  for (int x = 0; x < 50; ++x) {
    EXPECT_EQ(codes[x], x == 0 ? 1 : x == 1 ? 2 : x == 24 ? 0x3ff : x == 25 ? 0x55 : 0) << x;
  }
}

TEST(Unpack, GivesBackWhatABitWriterPacked) {
  std::minstd_rand random(3);
  for (const RawFormatNames& names : raw_formats()) {
    for (const int width : widths()) {
      const auto group = static_cast<std::size_t>(group_of(names.format).pixels);
      CodeRow codes((width + group - 1) / group * group);
      for (auto& code : codes) code = static_cast<std::uint16_t>((random() >> 8) & largest_code(names.format));
      const Row row = packed(names.format, codes);
      ASSERT_EQ(row.size(), row_bytes(names.format, width)) << name_of(names.format) << ", width " << width;
      const CodeRow back = unpacked(names.format, row, width);
      ASSERT_TRUE(std::equal(back.begin(), back.end(), codes.begin())) << name_of(names.format) << ", width " << width;
    }
  }
}

TEST(Unpack, TakesAnyBytesAndTouchesNothingBeyondThem) {
  for (const RawFormat& format : layouts()) expect_reference_between_guards(format, widths());
}

TEST(Unpack, TakesTheWidestRows) {
  for (const RawFormat& format : layouts()) expect_reference_between_guards(format, {65535, 65536});
}

// Rows at odd addresses, with other bytes between them; their codes lie between canaries.
TEST(Unpack, LeavesWhatLiesBetweenRowsAlone) {
  constexpr int width = 77, height = 5, canary = 0xbeef;
  std::minstd_rand random(5);
  for (const RawFormat& format : layouts()) {
    const std::size_t stride = row_bytes(format, width) + 13;
    Row frame(1 + stride * height);
    fill_at_random(frame, random);
    CodeRow codes((width + 1) * height, canary);
    for (int y = 0; y < height; ++y) {
      unpack_row(format, frame.data() + 1 + y * stride, width, codes.data() + std::size_t{width + 1} * y);
    }
    for (int y = 0; y < height; ++y) {
      const std::uint16_t* const row = codes.data() + std::size_t{width + 1} * y;
      EXPECT_EQ(first_difference(format, frame.data() + 1 + y * stride, width, row), width) << name_of(format);
      EXPECT_EQ(row[width], canary) << name_of(format);
    }
  }
}

// A camera that puts 16 bits where 10 are promised is not mended in silence.
TEST(Unpack, KeepsCodesAboveWhiteInSixteenBits) {
  for (const int bits : {10, 12, 14}) {
    const CodeRow codes = unpacked(mono(bits, RawPacking::little16), bytes_of({0xff, 0xff, 0x01, 0x80}), 2);
    EXPECT_EQ(codes, (CodeRow{0xffff, 0x8001})) << bits;
  }
}

TEST(Unpack, TouchesNothingForNoPixels) {
  for (const RawFormat& format : layouts()) {
    unpack_row(format, nullptr, 0, nullptr);
    unpack_row(format, nullptr, -1, nullptr);
  }
}

}  // namespace
}  // namespace lowlux::unpack_test
